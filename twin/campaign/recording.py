"""A whole campaign: one robot of the series, every trial simulated, measured and written.

    OUT/dataset/{dataset.json, nominal.urdf, trials/*.nc}      what a laboratory has
    OUT/truth/{truth.json, trials/*.nc}                        what nobody has

Trials run in parallel threads (the simulation holds no interpreter lock); random streams are named after the trial
and the instrument, so that the files depend neither on the number of threads nor on their order, longest first.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

import numpy as np

import mjcf
from calibration.recording import Trial, TrialEntry, write_trial
from twin import truth
from twin.base_tests.gravity_stiffness import gravity_stiffness
from twin.base_tests.slip_load import slip_loads
from twin.campaign.dataset_description import describe_dataset
from twin.campaign.laboratory_model import EPOCH, Laboratory, laboratory, second_session
from twin.campaign.measurement import measure
from twin.campaign.remounting import CONFIRMATION, session_parameters
from twin.config.twin import TwinConfig
from twin.defects.wheels.rolling_wheel import rolling_parameters
from twin.defects.wheels.stiffness import spatial_stiffness
from twin.motions.motion import Motion
from twin.motions.trial_schedule import schedule
from twin.simulation.force_plates import plate_centre
from twin.simulation.kinematic import arm_frame
from twin.truth import Parameter

Progress = Callable[[str, float], None]
Watch = Callable[[Trial], None]


def record(
    config: TwinConfig,
    seed: int,
    out: Path,
    progress: Progress | None = None,
    threads: int | None = None,
    watch: Watch = lambda trial: None,
) -> None:
    """Simulate a campaign and write OUT/dataset and OUT/truth.

    Args:
        config: Robot and laboratory.
        seed: Root of every random stream.
        out: Folder to write into.
        progress: Called with a text and the fraction done.
        threads: How many trials are simulated at once; None: one for each core.
        watch: Called with each trial once it is written, by the thread that made it.

    Raises:
        TwinError: The simulation failed; the message names the trial.
    """
    lab = laboratory(config, seed)
    for folder in ("dataset/trials", "truth/trials"):
        (out / folder).mkdir(parents=True, exist_ok=True)
    motions = schedule(config.campaign, mjcf.model(), seed)
    later = second_session(lab) if any(m.role == CONFIRMATION for m in motions) else lab
    starts = EPOCH + np.cumsum([0.0, *(m.duration + config.campaign.pause for m in motions[:-1])])
    done, total = 0.0, sum(m.duration for m in motions)
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        jobs = {}
        for motion, start in sorted(zip(motions, starts, strict=True), key=lambda x: x[0].duration, reverse=True):
            session = later if motion.role == CONFIRMATION else lab
            jobs[motion.id] = pool.submit(_one, session, motion, float(start), out, watch)
        motion_of = {jobs[m.id]: m for m in motions}
        try:
            for job in as_completed(motion_of):
                if job.exception():
                    break
                done += motion_of[job].duration
                if progress:
                    progress(f"{motion_of[job].id} ({motion_of[job].duration:.0f} s)", done / total)
            entries = [job.result() for job in motion_of]
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    description = describe_dataset(config, tuple(entries))
    (out / "dataset/dataset.json").write_text(description.model_dump_json(indent=1) + "\n", encoding="utf-8")
    (out / "dataset/nominal.urdf").write_text(mjcf.urdf(), encoding="utf-8")
    _write_truth(lab, later if later is not lab else None, out / "truth")


def _one(lab: Laboratory, motion: Motion, start: float, out: Path, watch: Watch) -> TrialEntry:
    states = lab.states(motion, start - EPOCH + motion.duration / 2.0)
    trial, true = measure(lab, motion, states, start)
    file = f"trials/{motion.id}.nc"
    digest = write_trial(out / "dataset" / file, trial)
    truth.write_trial(out / "truth" / file, true)
    watch(trial)
    return TrialEntry(
        id=motion.id,
        role=motion.role,
        kind=motion.kind,
        motion=motion.name,
        file=file,
        sha256=digest,
        payload=motion.payload,
    )


def _write_truth(lab: Laboratory, later: Laboratory | None, folder: Path) -> None:
    robot = lab.robot
    K, C = spatial_stiffness(robot.wheels)
    parameters: list[Parameter] = list(lab.twin.truth)
    for source in lab.instruments:
        parameters += source.parameters()
    if "wheels" in lab.config.campaign.driving.forms:
        parameters += (p for wheel in robot.wheels for p in rolling_parameters(wheel.name))
    if lab.config.campaign.driving.forms:
        parameters += arm_frame(lab.twin, next(iter(lab.config.arm)))
    derived = {"K": K, "C": C, "K_gravity": gravity_stiffness(lab.twin, robot.wheels)}
    derived |= {"slip_load": slip_loads(lab.twin, robot.wheels)}
    derived |= {"T_lab_base": lab.T_lab_base, "plate_centre": plate_centre(lab.twin.model)}
    derived |= {f"T_{c.frames.replace('.', '_')}": c.T_link_body for c in robot.clusters}
    if later is not None:
        parameters += session_parameters(later.robot)
        derived |= {f"{CONFIRMATION}.T_lab_base": later.T_lab_base}
        derived |= {f"{CONFIRMATION}.T_{c.frames.replace('.', '_')}": c.T_link_body for c in later.robot.clusters}
    truth.write_parameters(folder / "truth.json", parameters, derived)
