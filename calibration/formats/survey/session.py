"""All files of a session together: trials, bodies, measured joints, and the standard deviations they show.

Standard deviations are those of the samples at rest, of posture means those of a rigid body's distances.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from pathlib import Path

import numpy as np

from calibration.errors import InputError, InputErrors
from calibration.formats.mapping.channels import Means, Recorded
from calibration.formats.mapping.rests import noise_of
from calibration.formats.survey.bag_view import view_bag
from calibration.formats.survey.bodies import FoundBody, found_bodies
from calibration.formats.survey.c3d_view import view_c3d
from calibration.formats.survey.csv_view import view_csv
from calibration.formats.survey.robot import UrdfRobot, read_urdf
from calibration.formats.survey.trials import stem_of, suffixes
from calibration.formats.survey.view import FileView
from calibration.formats.survey.wrist_sign import convention_of
from calibration.mocap.cluster_shape import cluster, in_line
from calibration.recording.trial import REST

_SIGMAS = {"marker": 2e-4, "encoder": 2e-5, "plate_force": 1.0, "plate_moment": 0.3}  # where no file shows them
_LEAST = {"marker": 1e-5, "encoder": 1e-6, "plate_force": 1e-2, "plate_moment": 1e-3}


@dataclass(frozen=True)
class Drawing:
    """Marker bodies that somebody measured: `file` beside the mapping, and bodies with link and marker names."""

    file: str
    bodies: tuple[tuple[str, str, tuple[str, ...]], ...]


@dataclass(frozen=True)
class Session:
    """All files together.

    Attributes:
        robot: Of the URDF.
        views: File by file.
        tails: What follows a trial's name, by file name.
        trials: Everything recorded in each trial, by its name.
        bodies: Groups of labels, the one that moves least first.
        alone: Labels of no body.
        drawing: The measured bodies, None where nobody measured them.
        urdf: Text of the robot.
    """

    robot: UrdfRobot
    views: tuple[FileView, ...]
    tails: dict[str, str]
    trials: dict[str, Recorded]
    bodies: tuple[FoundBody, ...]
    alone: tuple[str, ...]
    drawing: Drawing | None
    urdf: str

    @cached_property
    def wrist(self) -> tuple[str, str]:
        """Link of the wrist's sensor, empty where there is none, and whose wrench it stores, empty where not shown."""
        if not any(r.joints is not None and r.joints.wrist_wrench is not None for r in self.trials.values()):
            return "", ""
        link = self.robot.wrist(self.tool)
        return link, convention_of(self.trials.values(), self.urdf, self.robot.root, link)

    @property
    def measured(self) -> tuple[str, ...]:
        """Joints between root and tool that were read; all of them where none was."""
        read = {
            n for r in self.trials.values() for n in (r.means.joints if r.means else r.joints.names if r.joints else ())
        }
        return self.robot.chain_to(self.robot.tool(read or self.robot.movable), read or self.robot.movable)

    @property
    def tool(self) -> str:
        """The link of the hand: of the drawing's body that most joints carry, else the tip of the chain."""
        if self.drawing is None:
            return self.robot.tool(self.measured)
        return max(
            (link for _, link, _ in self.drawing.bodies), key=lambda x: len(self.robot.chain_to(x, self.measured))
        )

    @property
    def has_readings(self) -> bool:
        """Whether any joint was read."""
        return any(r.means or r.joints for r in self.trials.values())


def session_of(files: Sequence[Path], urdf: str, drawing: Drawing | None = None) -> Session:
    """What the files show together.

    Raises:
        InputError: Some cannot be read; all findings.
    """
    robot, views, problems = read_urdf(urdf), [], []
    for path in files:
        try:
            views.append(_view(path, robot))
        except InputError as error:
            problems.append(error)
    if problems:
        raise InputErrors(problems)
    tails = suffixes(views)
    by_trial: dict[str, list[Recorded]] = {}
    for view in views:
        by_trial.setdefault(stem_of(view, tails), []).append(view.recorded)
    trials = {name: reduce(Recorded.with_channels_of, some) for name, some in sorted(by_trial.items())}
    if drawing is None:
        bodies, alone = found_bodies(list(trials.values()))
    else:
        bodies, alone = tuple(FoundBody(name, markers, 0.0) for name, _, markers in drawing.bodies), ()
    return Session(robot, tuple(views), tails, trials, bodies, alone, drawing, urdf)


def _view(path: Path, robot: UrdfRobot) -> FileView:
    if path.suffix.lower() == ".c3d":
        return view_c3d(path)
    if path.suffix.lower() == ".csv":
        return view_csv(path, robot)
    return view_bag(path, robot)


def sigmas_of(session: Session) -> dict[str, float]:
    """Standard deviations of a sample [m, rad, N, N.m]: of noise two digits, as rests show it, of a resolution four."""
    found: dict[str, list[float]] = {name: [] for name in _SIGMAS}
    for r in session.trials.values():
        if r.markers is not None:
            found["marker"].append(_at_rest(r.markers.t, r.markers.position.reshape(len(r.markers.t), -1)))
        if r.joints is not None:
            turning = [k for k, n in enumerate(r.joints.names) if n not in session.robot.prismatic(r.joints.names)]
            found["encoder"].append(_of_encoders(r.joints.q_motor[:, turning]))
        if r.means is not None:
            found["marker"] += [max(sigma, _SIGMAS["marker"]) for sigma in _of_means(session, r.means)]
    for view in session.views:
        for p in view.plates:
            sigma = noise_of(p.wrench)
            found["plate_force"].append(float(np.median(sigma[:3])))
            found["plate_moment"].append(float(np.median(sigma[3:])))
    return {
        name: float(
            f"{max(float(np.median(x)), _LEAST[name]) if x else _SIGMAS[name]:.{4 if name == 'encoder' else 2}g}"
        )
        for name, x in found.items()
    }


def _of_encoders(q: np.ndarray) -> float:
    """The coarsest resolution of readings q (n, k) [rad], each the smallest step between them; or their noise."""
    if not q.shape[1]:
        return _SIGMAS["encoder"]
    steps = np.abs(np.diff(q, axis=0))
    smallest = np.where(steps > _LEAST["encoder"], steps, np.inf).min(axis=0)
    resolution = float(np.max(smallest[np.isfinite(smallest)], initial=0.0))
    noise = float(np.max(noise_of(q)))
    return resolution if resolution > 0.3 * noise else noise


def _at_rest(t: np.ndarray, x: np.ndarray) -> float:
    """Median standard deviation of the columns of x (n, k) in the first second, when the robot rests."""
    first = x[t <= t[0] + REST]
    seen = np.isfinite(first).sum(axis=0) > 1
    noise = np.nanstd(first[:, seen], axis=0, ddof=1) if seen.any() else np.zeros(0)
    return float(np.median(np.maximum(noise, noise_of(x)[seen]))) if len(noise) else 0.0


def _of_means(session: Session, means: Means) -> list[float]:
    """Noise of each body's markers, from its distances [m]."""
    shapes = [[means.markers.index(n) for n in b.markers if n in means.markers] for b in session.bodies]
    p = [means.position[:, columns] for columns in shapes if len(columns) > 2]
    return [cluster(x).sigma for x in p if not in_line(x)]
