"""A run of a head-to-head of joint corrections: rms error of the link angles against the truth.

    e = q_corrected - q_link - zero        zero  mean over the calibration dwells without a tenth at either end

Corrections: none; the printed sigmoid with each of its term sets; the physical drive trains of row `full`. Motions: in
sample (moving calibration trials), new motion (moving validation trials), static (means over the middle half of each
validation dwell).
"""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import numpy as np
from scipy.stats import trim_mean

from scenarios.datasets.run_spec import Magnitude
from scenarios.files.scenario import Scenario

if TYPE_CHECKING:
    from calibration import Dataset, Estimate
    from calibration.recording import Clock as RobotClock
    from calibration.recording import Trial

    Correction = Callable[[Trial], np.ndarray]

Clock = Callable[[np.ndarray], np.ndarray]
MOTIONS = ("in_sample", "new_motion", "static")
_TRIMMED = 0.1


def head_to_head(scenario: Scenario, out: Path) -> tuple[Magnitude, ...]:
    """Rms errors of one robot, `<correction>.<motion>.<joint>_mrad`; nothing is written.

    Raises:
        CalibrationError: There is no result that may be used.
    """
    import calibration
    import twin

    work = out / "work"
    twin.record(scenario.twin, scenario.seed, work, threads=1)
    dataset = calibration.load(work / "dataset")
    estimate = calibration.calibrate(dataset, stages=("suspension", "joints", "bundle"))
    found = figures(dataset, estimate, work / "truth")
    shutil.rmtree(work)
    return found


def figures(dataset: "Dataset", estimate: "Estimate", truth: Path) -> tuple[Magnitude, ...]:
    """The same of a calibrated robot, of its revolute joints; `truth` is its folder of truth."""
    from calibration.errors import NotEnoughData
    from calibration.robot import chain_of

    chain, robot = chain_of(dataset.urdf, dataset.description), estimate.clock("robot")
    if robot is None:
        raise NotEnoughData("no clock of the robot: its readings cannot be compared with the truth")
    turning = [joint for joint in chain.joints if not chain.is_prismatic(joint)]
    return tuple(
        Magnitude(f"{name}.{motion}.{joint}_mrad", float(rms))
        for name, correction in _corrections(dataset, estimate, robot).items()
        for motion, errors in _errors(dataset, truth, correction, robot.to_mocap).items()
        for joint, rms in zip(dataset.description.joint_names, errors, strict=True)
        if joint in turning
    )


def _corrections(dataset: "Dataset", estimate: "Estimate", robot: "RobotClock") -> "dict[str, Correction]":
    """Link angles (n, k), NaN where a motor reading is missing, of a trial by each correction."""
    from calibration.mocap import relabelled_trials
    from calibration.options import Terms
    from calibration.prediction import link_angles
    from calibration.robot import Laboratory
    from calibration.stages.geometry import hand_of
    from calibration.stages.joints import JointModels, correct, fit_joint_models

    lab = Laboratory(dataset.urdf, dataset.description)
    hand = hand_of(estimate.model("model_2"), lab.chain, lab.nominal_frames)
    trials = [trial for _, trial in relabelled_trials(dataset, "calibration")]

    def sigmoid(models: JointModels, trial: "Trial") -> np.ndarray:
        rows = np.isfinite(trial.q_motor).all(axis=1)
        q = np.full(trial.q_motor.shape, np.nan)
        q[rows] = correct(models.of_trial(trial.id), trial.t_robot[rows], trial.q_motor[rows]).q
        return q

    found: dict[str, Correction] = {"none": lambda trial: trial.q_motor}
    for terms in get_args(Terms):
        models, _ = fit_joint_models(lab, trials, robot, hand, terms)
        found[f"sigmoid_{terms}"] = lambda trial, models=models: sigmoid(models, trial)  # type: ignore[misc]
    if estimate.bundle is not None:
        physical, entries = link_angles(estimate, dataset), {entry.id: entry for entry in dataset.description.trials}
        found["physical"] = lambda trial: physical(entries[trial.id], trial)
    return found


def _errors(dataset: "Dataset", truth: Path, correction: "Correction", to_mocap: Clock) -> dict[str, np.ndarray]:
    """Rms (k,) [mrad] of each motion."""
    off: dict[str, list[np.ndarray]] = {"zero": [], **{motion: [] for motion in MOTIONS}}
    for entry in dataset.description.trials:
        trial = dataset.read(entry)
        e, t = _difference(trial, truth / entry.file, correction, to_mocap)
        quarter = 0.25 * (trial.dwell_stop - trial.dwell_start)
        windows = np.stack([trial.dwell_start + quarter, trial.dwell_stop - quarter], axis=1)
        dwells = [e[(t >= start) & (t <= stop)].mean(axis=0) for start, stop in windows]
        if dwells:
            off["zero" if entry.role == "calibration" else "static"] += dwells
        else:
            off["in_sample" if entry.role == "calibration" else "new_motion"].append(e)
    zero = trim_mean(np.array(off["zero"]), _TRIMMED)
    seen = [motion for motion in MOTIONS if off[motion]]
    return {motion: 1e3 * np.sqrt(((np.vstack(off[motion]) - zero) ** 2).mean(axis=0)) for motion in seen}


def _difference(
    trial: "Trial", truth: Path, correction: "Correction", to_mocap: Clock
) -> tuple[np.ndarray, np.ndarray]:
    """Corrected readings less true link angles (n, k), and mocap times (n,) of the readings."""
    from twin.truth import read_trial

    q, true, t = correction(trial), read_trial(truth), to_mocap(trial.t_robot)
    rows = np.isfinite(q).all(axis=1) & (t >= true.t_mocap[0]) & (t <= true.t_mocap[-1])
    columns = [true.q_link_true[:, true.joint.index(joint)] for joint in trial.joint]
    link = np.stack([np.interp(t[rows], true.t_mocap, column) for column in columns], axis=1)
    return q[rows] - link, t[rows]
