"""What a 3D view of one held-out trial shows, from a run folder: recordings, predictions, nominal robot; no truth.

base        T_0 exp6(m log6(T_0^-1 T(t)))           its measured motion from the first sample on, m times as large
markers     B p,  B = base(t) T(t)^-1               moved along with the base
ghost       T_H exp6(m log6(T_H^-1 T_predicted))    the hand where a row predicts it, its error m times as large
residual    from the measured hand to its ghost
force       the plate's reaction from its centre of pressure, 0.7 mm a newton
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import calibration
from calibration import robot as nominal_robot
from calibration.mocap import poses_of, relabelled_trial
from calibration.numerics.lie import compose, exp6, from_vector, inverse, log6
from calibration.numerics.signals import interpolate_columns
from calibration.numerics.wrench import centre_of_pressure
from calibration.prediction import LADDER, NOMINAL
from calibration.recording import Clock, Dataset, Trial, netcdf
from calibration.robot import Chain, chain_of
from scenarios.files.errors import ScenarioError

METRES_PER_NEWTON = 0.7e-3
_RATE = 10.0  # [Hz] of what is shown


@dataclass(frozen=True)
class Moments:
    """A trial at n times; m is the magnification.

    Attributes:
        trial: Its name.
        t: (n,) [s] from its start.
        links: T_lab_link (n, 4, 4) by link, its base m times as far from where it stood.
        markers: (n, k, 3) [m, lab], NaN where hidden.
        hand: T_lab_hand (n, 4, 4) as measured.
        ghosts: T_lab_hand (n, 4, 4) by row of the ladder, its position error m times as large.
        hand_links: T_hand_link (4, 4) of the links that move with the hand.
        force: Foot and head (n, 2, 3) [m, lab] of the plate's reaction; NaN without.
    """

    trial: str
    t: np.ndarray
    links: dict[str, np.ndarray]
    markers: np.ndarray
    hand: np.ndarray
    ghosts: dict[str, np.ndarray]
    hand_links: dict[str, np.ndarray]
    force: np.ndarray


def moments(run: Path, dataset: Dataset, trial_id: str | None, links: tuple[str, ...], magnify: float) -> Moments:
    """Read a trial of a run folder.

    Args:
        run: The run folder.
        dataset: Its dataset.
        trial_id: A held-out trial that moves; None: the first one.
        links: Links with a shape.
        magnify: m.

    Raises:
        ScenarioError: There is no such trial, or no prediction of it.
        InputError: A file cannot be read.
    """
    estimate = calibration.load_estimate(run / "estimate")
    trial, predictions = _read(run, dataset, trial_id)
    shown = np.searchsorted(trial.t_mocap, np.arange(trial.t_mocap[0], trial.t_mocap[-1], 1.0 / _RATE))
    t, chain = trial.t_mocap[shown], chain_of(dataset.urdf, dataset.description)
    T_base_B, T_tool_H = (from_vector(v) for v in np.split(nominal_robot.nominal_frames(chain, dataset.description), 2))
    base = _filled(poses_of(dataset.description.base_body, trial).T[shown]) @ inverse(T_base_B)
    hand = _filled(poses_of(dataset.description.hand_body, trial).T[shown])
    robot, plate = (_clock(estimate, name) for name in ("robot", "plate"))
    q = interpolate_columns(robot.from_mocap(t), trial.t_robot, trial.q_motor)
    moved = base[:1] @ exp6(magnify * log6(inverse(base[:1]) @ base))
    along = moved @ inverse(base)
    still = np.zeros((1, q.shape[1]))
    T_tool = {link: inverse(chain.poses(still)) @ chain.poses(still, link) for link in _of_hand(chain, q, links)}
    with netcdf.opened(predictions, "make it again with evaluate") as file:
        poses = {model: _predicted(file, model) for model in dict.fromkeys((NOMINAL, estimate.main))}
    ghosts = {model: _farther(hand, T[shown], magnify) for model, T in poses.items() if T is not None}
    return Moments(
        trial=trial.id,
        t=t - t[0],
        links={link: moved @ chain.poses(q, link) for link in links},
        markers=trial.marker_position[shown] @ along[:, :3, :3].swapaxes(1, 2) + along[:, None, :3, 3],
        hand=along @ hand,
        ghosts={model: along @ T for model, T in ghosts.items()},
        hand_links={link: (inverse(T_tool_H) @ T)[0] for link, T in T_tool.items()},
        force=_force(trial, plate.from_mocap(t)),
    )


def _farther(T_from: np.ndarray, T_to: np.ndarray, m: float) -> np.ndarray:
    """Poses (n, 4, 4) as T_to is, their position m times as far from T_from."""
    p = T_from[:, :3, 3] + m * (T_to[:, :3, 3] - T_from[:, :3, 3])
    return compose(T_to[:, :3, :3], p)


def _read(run: Path, dataset: Dataset, trial_id: str | None) -> tuple[Trial, Path]:
    paths = {e.id: run / "predictions" / f"{e.id}.nc" for e in dataset.entries("validation") if e.kind != "static"}
    known = [name for name, path in paths.items() if path.is_file()]
    wanted = trial_id or next(iter(known), None)
    if wanted not in known:
        named = "" if wanted is None else f" {wanted!r}"
        raise ScenarioError(
            f"{run}: no prediction of a trial{named} that moves; there are: {', '.join(known) or 'none'}"
        )
    entry = next(e for e in dataset.entries("validation") if e.id == wanted)
    return relabelled_trial(dataset, entry), paths[entry.id]


def _clock(estimate: calibration.Estimate, instrument: str) -> Clock:
    return estimate.clock(instrument) or Clock(instrument, 0.0, 0.0, np.zeros((2, 2)), 0.0, 0.0)


def _predicted(file: netcdf.Group, model: str) -> np.ndarray | None:
    """T_lab_hand (n, 4, 4) by a row of the ladder, motor encoders and its best source of the base's motion."""
    row = next((row for row in LADDER if row.name == model), None)
    bases = file["rows"].groups[model].groups if model in file["rows"].groups else {}
    base = None if row is None else row.predictive_base(bases) or next(iter(bases), None)
    if base is None:
        return None
    group = bases[base]["motor"]
    quaternions = netcdf.array(group, "quaternion_wxyz")
    known = np.isfinite(quaternions).all(axis=1)
    quaternions[~known] = [1.0, 0.0, 0.0, 0.0]
    T = compose(Rotation.from_quat(quaternions, scalar_first=True).as_matrix(), netcdf.array(group, "position"))
    T[~known] = np.nan
    return _filled(T)


def _filled(T: np.ndarray) -> np.ndarray:
    """Unknown poses replaced by the last known one, or the first."""
    known = np.isfinite(T).all(axis=(1, 2))
    if not known.any():
        raise ScenarioError("the trial shows no pose of the base or of the hand; view another one")
    last = np.maximum.accumulate(np.where(known, np.arange(len(T)), np.argmax(known)))
    return np.asarray(T[last])


def _of_hand(chain: Chain, q: np.ndarray, links: tuple[str, ...]) -> list[str]:
    """Links that do not move against the tool frame."""
    some = q[:: max(1, len(q) // 5)]
    relative = {link: inverse(chain.poses(some)) @ chain.poses(some, link) for link in links}
    return [link for link, T in relative.items() if np.ptp(T, axis=0).max() < 1e-9]


def _force(trial: Trial, t_plate: np.ndarray) -> np.ndarray:
    """Foot and head (n, 2, 3) of the reaction of the plate that bears most; NaN without a plate."""
    if not len(trial.t_plate):
        return np.full((len(t_plate), 2, 3), np.nan)
    most = int(np.argmax(np.abs(trial.plate_wrench[:, :, 2]).sum(axis=0)))
    wrench = interpolate_columns(t_plate, trial.t_plate, trial.plate_wrench[:, most])
    foot = centre_of_pressure(wrench, trial.plate_centre[most])
    return np.stack([foot, foot - METRES_PER_NEWTON * wrench[:, :3]], axis=1)
