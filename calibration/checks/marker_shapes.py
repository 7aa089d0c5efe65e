"""Marker bodies that contradict their drawing, or themselves: scale, one marker elsewhere, a marker that was moved.

    p_k = R (s x_k + e_k) + t        x_k drawn, s the scale of the measurement, e_k where marker k really is   [m]
    s = 1 + sum e_k . x_k / sum |x_k|^2 over all bodies, x_k from each body's centre

e_k are medians over samples of the residuals of the rigid bodies that fit best. Their usual size u, over all bodies,
is what drawing and drilling leave; s has the standard deviation u / sqrt(sum |x_k|^2), and a marker is compared with
where the others put it. Motion capture that is 1 % too large makes a robot 1 % too large: joint placements follow it,
and no residual shows it.

Motion capture whose scale is not the same in all directions strains what it sees, R'E R x_k with E traceless in the
laboratory: bodies change their shape as they turn. E by least squares with a constant e_k, taken off where it explains
a fifth of the change.

Within a campaign the e_k of a rigid body stay: where those of some windows differ from what most have by ten times the
markers' noise, a marker was moved, slipped, or is another.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from calibration.errors import NotEnoughData
from calibration.mocap.cluster_pose import body_poses
from calibration.recording.posture_means import PostureMeans
from calibration.recording.schema import Body, Description
from calibration.recording.trial import Trial
from calibration.robot.laboratory import Laboratory
from calibration.robot.nominal_frames import AXES, frame_names
from calibration.verdict import Direction, Verdict

STAGE = "reading"
_MANY = 400  # samples of a trial that are looked at
_SURE = 5.0  # standard deviations
_SCALE, _WRONG_SCALE = 1e-3, 5e-3  # off by less is 1 mm at the hand, by more 5 mm [-]
_ODD, _FAR = 3.0, 1e-3  # times the usual size, and [m], a marker may be off its drawing unsaid
_WINDOW = 2.0  # [s]
_QUIET = 20.0  # times less than declared that markers may scatter unsaid
_STRAIN, _WRONG_STRAIN = 2e-3, 1e-2  # of one direction against another [-]
_TURNED = 0.1  # [rad] rms of a body that shows directions of the laboratory
_EXPLAINS, _STRETCH, _TURNS = 0.2, 0.02, 100.0  # share of the change; prior of E [-], and the samples it is worth
_MOVED, _LASTING = 10.0, 2  # standard deviations of a marker's noise; windows in which it shows, a ghost in one


@dataclass(frozen=True)
class Shape:
    """What the samples of a trial show of a body.

    Attributes:
        trial: Its id.
        t: (n,) [s]; None of posture means, whose odd ones are left out one by one.
        e: (n, m, 3) markers less their drawing [m, body], NaN where hidden; all of them are fitted together.
        R: (n, 3, 3) R_lab_body.
    """

    trial: str
    t: np.ndarray | None
    e: np.ndarray
    R: np.ndarray


def wrong_shapes(lab: Laboratory, trials: Sequence[Trial | PostureMeans]) -> Iterator[Verdict]:
    """What the markers of each body say against their drawing or against each other."""
    description = lab.description
    shapes = {b.name: [s for t in trials if (s := _shape(b, t)) is not None] for b in description.bodies}
    bodies = {b.name: b for b in description.bodies if shapes[b.name] and len(b.markers) >= 3}
    E, share = _strain([(_drawn(b), shapes[name]) for name, b in bodies.items()])
    strain = np.ptp(np.linalg.eigvalsh(E))
    if share > _EXPLAINS and strain > _STRAIN:
        message = (
            f"the motion capture's scale differs by {100.0 * strain:.1f} % between two directions, markers of bodies "
            "that turn show: calibrate it again (its wand), in all of the room"
        )
        yield Verdict(STAGE, "refused" if strain > _WRONG_STRAIN else "warning", message, (_grown(lab, strain),))
        shapes = {name: [_unstrained(_drawn(bodies[name]), s, E) for s in shapes[name]] for name in bodies}
    usual = {name: _median(np.concatenate([s.e for s in shapes[name]])) for name in bodies}
    known = {name: e for name, e in usual.items() if np.isfinite(e).all()}
    if not known:
        return
    moving = [_scatter(shapes[name], e) for name, e in known.items()]
    if np.nanmax([0.0, *moving]) * _QUIET < description.sigmas.marker and np.isfinite(moving).any():
        message = (
            f"markers scatter by {1e3 * np.nanmax(moving):.2g} mm, sigmas.marker of dataset.json is "
            f"{1e3 * description.sigmas.marker:.2g} mm: correct it (in metres), what the markers show hardly counts"
        )
        yield Verdict(STAGE, "warning", message)
    xyz = {name: _drawn(bodies[name]) for name in known}
    scale, sigma = _scale([(xyz[name], e) for name, e in known.items()])
    if abs(scale - 1.0) > max(_SURE * sigma, _SCALE):
        message = (
            f"markers are {scale:.4f} +- {sigma:.4f} times as far apart as in dataset.json, and the robot would "
            "become as much too large: calibrate the motion capture again (its wand), or correct the drawings"
        )
        refused = abs(scale - 1.0) > _WRONG_SCALE
        yield Verdict(STAGE, "refused" if refused else "warning", message, (_grown(lab, scale - 1.0),))
    else:
        scale = 1.0
    left = {name: e - (scale - 1.0) * (xyz[name] - xyz[name].mean(axis=0)) for name, e in known.items()}
    u = _size(list(left.values()))
    limit = description.tolerances.body_translation
    for name, e in left.items():
        moved = list(_moved(bodies[name], shapes[name], description.sigmas.marker, limit))
        for off, verdict in moved or _misdrawn(bodies[name], e, u, limit):
            yield replace(verdict, moves=_turned(description, bodies[name], off))


def _grown(lab: Laboratory, by: float) -> Direction:
    """Every length of the robot and its marker frames, longer by a share; nothing where no hand is seen."""
    try:
        chain, frames = lab.chain, lab.nominal_frames
    except NotEnoughData:
        return ()
    found: list[tuple[str, float]] = []
    for joint in chain.joints:
        M = chain.nominal.jointPlacements[chain.nominal.getJointId(joint)]
        found += zip(
            (f"geometry.{joint}.{axis}" for axis in AXES[:3]), by * (M.rotation.T @ M.translation), strict=True
        )
    for prefix, p in zip(frame_names(), (frames[:3], frames[6:9]), strict=True):
        found += zip((f"{prefix}.{axis}" for axis in AXES[:3]), by * p, strict=True)
    return tuple((name, float(size)) for name, size in found)


def _turned(description: Description, body: Body, off: float) -> tuple[Direction, ...]:
    """What a marker that is `off` [m] does at most to the frame of its body: shares of least squares."""
    known = dict(zip((description.base_body.name, description.hand_body.name), frame_names(), strict=True))
    if body.name not in known:
        return ()
    xyz = _drawn(body)
    radius = float(np.sqrt(((xyz - xyz.mean(axis=0)) ** 2).sum(axis=1).mean()))
    sizes = np.repeat([off / len(xyz), off / (np.sqrt(len(xyz)) * radius)], 3)
    return tuple(((f"{known[body.name]}.{axis}", float(x)),) for axis, x in zip(AXES, sizes, strict=True))


def _drawn(body: Body) -> np.ndarray:
    return np.array([m.xyz for m in body.markers])


def _shape(body: Body, trial: Trial | PostureMeans) -> Shape | None:
    """A body in some samples of a trial; None where its markers are not all there, or never three at once."""
    if len(body.markers) < 3 or any(m.name not in trial.marker for m in body.markers):
        return None
    columns = [trial.marker.index(m.name) for m in body.markers]
    rows = slice(None, None, max(1, len(trial.marker_position) // _MANY))
    found = body_poses(_drawn(body), trial.marker_position[rows][:, columns])
    if not np.isfinite(found.T).any():
        return None
    t = None if isinstance(trial, PostureMeans) else trial.t_mocap[rows]
    R = found.T[:, :3, :3]
    return Shape(trial.id, t, np.einsum("nji,nmj->nmi", R, found.residual), R)


_SHEARS = np.zeros((5, 3, 3))  # traceless and symmetric
_SHEARS[[0, 0, 1, 1], [0, 1, 1, 2], [0, 1, 1, 2]] = 1.0, -1.0, 1.0, -1.0
_SHEARS[[2, 2, 3, 3, 4, 4], [0, 1, 0, 2, 1, 2], [1, 0, 2, 0, 2, 1]] = 1.0


def _strain(bodies: Sequence[tuple[np.ndarray, Sequence[Shape]]]) -> tuple[np.ndarray, float]:
    """E (3, 3), and the share of the changes of shape that it explains, of bodies drawn (m, 3) [m] that turn."""
    A, y = np.zeros((0, len(_SHEARS))), np.zeros(0)
    for xyz, shapes in bodies:
        e, R = (np.concatenate([getattr(s, name) for s in shapes]) for name in ("e", "R"))
        whole = np.isfinite(e).all(axis=(1, 2))
        turned = (
            np.sqrt(((R[whole] - R[whole].mean(axis=0)) ** 2).sum(axis=(1, 2)).mean() / 2.0) if whole.any() else 0.0
        )
        if turned > _TURNED:
            f = np.stack([_stretched(xyz, R[whole], shear) for shear in _SHEARS], axis=3)
            A = np.concatenate([A, (f - f.mean(axis=0)).reshape(-1, len(_SHEARS))])
            y = np.append(y, e[whole] - e[whole].mean(axis=0))
    known = _TURNS * float(np.mean(y**2)) / _STRETCH**2 + np.finfo(float).tiny if len(y) else 1.0
    c = np.linalg.solve(A.T @ A + known * np.eye(len(_SHEARS)), A.T @ y)
    left, all_ = float(((y - A @ c) ** 2).sum()), float((y**2).sum())
    return np.tensordot(c, _SHEARS, axes=1), 1.0 - left / all_ if all_ else 0.0


def _stretched(xyz: np.ndarray, R: np.ndarray, E: np.ndarray) -> np.ndarray:
    """What a strain E of the laboratory leaves of markers (m, 3) [m] fitted as a rigid body R (n, 3, 3): (n, m, 3)."""
    x = xyz - xyz.mean(axis=0)
    f = x @ (np.swapaxes(R, 1, 2) @ E @ R)
    turn = np.cross(x, f).sum(axis=1) @ np.linalg.inv((x**2).sum() * np.eye(3) - x.T @ x)
    return np.asarray(f - np.cross(turn[:, None], x))


def _unstrained(xyz: np.ndarray, shape: Shape, E: np.ndarray) -> Shape:
    return replace(shape, e=shape.e - _stretched(xyz, shape.R, E))


def _median(e: np.ndarray) -> np.ndarray:
    """Median (m, 3) over samples e (n, m, 3) that show every marker; NaN without one."""
    whole = e[np.isfinite(e).all(axis=(1, 2))]
    return np.median(whole, axis=0) if len(whole) else np.full(e.shape[1:], np.nan)


def _scatter(shapes: Sequence[Shape], usual: np.ndarray) -> float:
    """rms [m] of residuals about the usual ones (m, 3), noise and all else; NaN where there are means alone."""
    e = [s.e - usual for s in shapes if s.t is not None]
    return float(np.sqrt(np.nanmean(np.concatenate(e) ** 2))) if e else np.nan


def _scale(known: Sequence[tuple[np.ndarray, np.ndarray]]) -> tuple[float, float]:
    """Scale of the measurement and its standard deviation [-], from drawings and residuals (m, 3) of all bodies."""
    centred = [(x - x.mean(axis=0), e) for x, e in known]
    square = sum(float((x**2).sum()) for x, _ in centred)
    grown = sum(float((x * e).sum()) for x, e in centred) / square
    free = sum(3 * len(x) - 6 for x, _ in centred) - 1
    left = sum(float(((e - grown * x) ** 2).sum()) for x, e in centred)
    return 1.0 + grown, float(np.sqrt(left / max(free, 1) / square))


def _size(e: Sequence[np.ndarray]) -> float:
    """Usual size of a coordinate of the residuals (m, 3) of several bodies, one strange body apart [m]."""
    return float(np.median([np.sqrt((x**2).sum() / max(3 * len(x) - 6, 1)) for x in e]))


def _misdrawn(body: Body, e: np.ndarray, usual: float, limit: float) -> Iterator[tuple[float, Verdict]]:
    """A marker that is not where the others put it, or a body of another shape, and by how much; e (m, 3) residuals."""
    xyz = _drawn(body)
    m, measured = len(xyz), xyz + e
    size = float(np.sqrt((e**2).sum() / max(3 * m - 6, 1)))
    if m < 4:  # a triangle does not say which of its corners is wrong
        worst, name, left = size, "", 0.0
    else:
        off, rest = zip(*(_against_others(xyz, measured, k) for k in range(m)), strict=True)
        k = int(np.argmin(rest))
        worst, name, left = off[k], body.markers[k].name, rest[k]
    if size <= max(_ODD * min(usual, _FAR), 0.5 * _FAR) or worst <= _FAR:
        return
    alone = name and left < 0.5 * size
    remedy = "correct the drawing in dataset.json, or the labels"
    if _mirrored(xyz, measured) < 0.5 * size:
        what, remedy = (
            "its markers move as in a mirror",
            "two labels are exchanged, or the laboratory's frame is left-handed: swap two axes or turn one",
        )
    elif alone:
        what, remedy = f"marker {name} is {1e3 * worst:.1f} mm from its drawing", f"{remedy}, or leave this marker out"
    else:
        what = f"its markers are {1e3 * size:.1f} mm rms from their drawing"
    verdict: Literal["warning", "refused"] = "refused" if (worst if alone else size) > limit else "warning"
    yield worst if alone else size, Verdict(STAGE, verdict, f"body {body.name}: {what}; {remedy}")


def _mirrored(xyz: np.ndarray, measured: np.ndarray) -> float:
    """Size of the residuals against the mirrored drawing [m]."""
    r = body_poses(xyz * [1.0, 1.0, -1.0], measured[None]).residual
    return float(np.sqrt((r**2).sum() / max(3 * len(xyz) - 6, 1)))


def _against_others(xyz: np.ndarray, measured: np.ndarray, k: int) -> tuple[float, float]:
    """How far marker k is from where the others put it, and how large the others' own residuals are [m]."""
    others = np.arange(len(xyz)) != k
    found = body_poses(xyz[others], measured[None, others])
    T = found.T[0]
    off = float(np.linalg.norm(T[:3, :3] @ xyz[k] + T[:3, 3] - measured[k]))
    return off, float(np.sqrt((found.residual**2).sum() / max(3 * others.sum() - 6, 1)))


def _moved(body: Body, shapes: Sequence[Shape], sigma: float, limit: float) -> Iterator[tuple[float, Verdict]]:
    """Trials and times in which a body has another shape than in most of the campaign, and how far a marker moved."""
    windows = [
        (f"{s.trial} at {start - s.t[0]:.0f} s", _median(s.e[(s.t >= start) & (s.t < start + _WINDOW)]))
        for s in shapes
        if s.t is not None
        for start in np.arange(s.t[0], s.t[-1], _WINDOW)
    ]
    windows = [(name, e) for name, e in windows if np.isfinite(e).all()]
    if not windows:
        return
    e = np.array([e for _, e in windows])
    usual = e[int(np.argmin([np.median(np.linalg.norm(e - one, axis=2).max(axis=1)) for one in e]))]
    off = np.linalg.norm(e - usual, axis=2).max(axis=1)
    moved = np.flatnonzero(off > _MOVED * sigma)
    if len(moved) < _LASTING:
        return
    message = (
        f"body {body.name}: a marker moved by {1e3 * off.max():.1f} mm against the others, in {len(moved)} of "
        f"{len(e)} windows of {_WINDOW:.0f} s, the first in {windows[moved[0]][0]}; fix it, and record these again"
    )
    yield float(off.max()), Verdict(STAGE, "refused" if off.max() > limit else "warning", message)
