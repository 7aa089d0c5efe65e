"""What the robot weighs, and where the plate is under it, by seconds at rest on a force plate.

    v - u = |v_1| (0, o) + g sum_i (dm_i (1, x_i, y_i) + m_i (0, (R_i dc_i)_xy))

v, u: (-Fz, My, -Mx) by the plate and of the nominal robot [N, N.m, frame 0]; o how far the plate seems from its
declared place; body i has its nominal mass m_i and centre of mass (x_i, y_i), axes R_i, and is off by dm_i and dc_i.
The robot leans on its springs by (rx, ry), and has moved by (x, y, yaw) since the trial began, its centre of mass at a
height h:

    u <- u + |u_1| (0, x + ry h, y - rx h) + yaw (0, -u_3, u_2)

All of them normal: o as a marker body is on its link and a plate in the lab, links as `Tolerances` has them; the centre
of mass of the root, which stands as it was built, to 2 mm. Postures tell the links' masses from the plate's place.
Links that one robot in a thousand is as far from nominal as are not believed: s' S^-2 s of what was found, of
tr(1 - C) degrees of freedom, C the covariance over the tolerances' S^2.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from scipy.special import chdtri

from calibration.errors import NotEnoughData
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.numerics.signals import Signal
from calibration.recording.clock import Clock
from calibration.recording.schema import Description
from calibration.recording.trial import REST, Trial
from calibration.robot.laboratory import Laboratory
from calibration.robot.urdf import LinkMasses
from calibration.stages.suspension.base_response import WrenchSources
from calibration.stages.suspension.floor_wrench import root_in_base, vertical
from calibration.stages.suspension.rest_frame import Rest, rest_of
from calibration.verdict import Verdict

FARTHEST = 0.02  # [rad] that a base leans
_ROOT = 2e-3  # [m]
_STILL, _CALM = 0.01, 2.0  # [rad, m] of a joint in a second; of the plate's load over that of the first one
_FEWEST = 20  # readings in it
_UNLIKELY = 1e-3
_FORCE, _LEVER = 2.0, 3e-4  # [N], [m] of the weight: what a second at rest leaves unexplained
_PLANE, _HEAVE = (0, 1, 5), (2, 3, 4)
_OTHERS = (
    "the plate weighs links otherwise than their tolerances let expect: not used; check the payload, "
    "and the plate's scale, place and axes"
)


class Second(NamedTuple):
    """A second at rest.

    Attributes:
        q: (k,) readings [rad, m].
        v: (3,) (-Fz, My, -Mx) by the plate.
        x: (3,) x, y, yaw since the first second [m, rad].
        u: (3,) of a robot that stands upright where the trial began; None: of the nominal one at q.
    """

    q: np.ndarray
    v: np.ndarray
    x: np.ndarray
    u: np.ndarray | None = None


@dataclass(frozen=True)
class Weighed:
    """What seconds at rest say.

    Attributes:
        links: What the robot weighs.
        off: (2,) o [m].
        sigma: (2,) of it.
        seems: (2,) o of an upright robot, were its links what they are taken for.
        likely: Whether tolerances let expect such links.
        covariance: (4 b, 4 b) of the shares and shifts of b bodies.
    """

    links: LinkMasses
    off: np.ndarray
    sigma: np.ndarray
    seems: np.ndarray
    likely: bool
    covariance: np.ndarray


def leans(K: np.ndarray, load: np.ndarray) -> np.ndarray:
    """(rx, ry) [rad] from the vertical under a load (-Fz, My, -Mx) at rest, by springs K (6, 6) of the same length."""
    h = np.linalg.solve(K[np.ix_(_HEAVE, _HEAVE)], load[[0, 2, 1]] * (-1.0, -1.0, 1.0))
    return np.asarray(np.clip(h[1:], -FARTHEST, FARTHEST))


def weighed(seconds: Sequence[tuple[Laboratory, Second]], K: np.ndarray | None) -> Weighed:
    """Links and the plate's place by seconds at rest, each of a robot with its payload.

    Args:
        seconds: One at least.
        K: (6, 6) springs on which the base leans; None: it stands upright.
    """
    lab = seconds[0][0]
    rows = [_row(own, second, K) for own, second in seconds]
    A, upright, moved = (np.concatenate(column) for column in zip(*rows, strict=True))
    weight = np.mean([row[0][1, -2] for row in rows])
    noise = np.tile([_FORCE, _LEVER * weight, _LEVER * weight], len(rows))
    sigma = _tolerances(lab.floating.njoints - 1, lab.description)
    A = A * sigma / noise[:, None]
    covariance = np.linalg.inv(A.T @ A + np.eye(len(sigma)))
    found = covariance @ A.T @ ((upright - moved) / noise)
    likely = (found[:-2] ** 2).sum() < chdtri((1.0 - np.diag(covariance)[:-2]).sum(), _UNLIKELY)
    found, covariance = sigma * found, sigma[:, None] * covariance * sigma
    bodies = found[:-2].reshape(-1, 4)
    links = LinkMasses(tuple(lab.floating.names)[1:], bodies[:, 0].copy(), bodies[:, 1:].copy())
    seems = upright.reshape(-1, 3).mean(axis=0)[1:] / weight
    place = np.sqrt(np.diag(covariance)[-2:])
    return Weighed(links, found[-2:], place, seems, bool(likely), covariance[:-2, :-2])


def _row(lab: Laboratory, second: Second, K: np.ndarray | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Columns (3, 4 bodies + 2), v - u of an upright robot (3,), and what leaning and moving add to u (3,)."""
    columns, nominal, height = columns_of(lab, second)
    u, (x, y, yaw) = nominal if second.u is None else second.u, second.x
    rx, ry = (0.0, 0.0) if K is None else leans(K, second.v)
    moved = np.array([0.0, u[0] * x - yaw * u[2] + height * ry, u[0] * y + yaw * u[1] - height * rx])
    return columns, second.v - u, moved


def columns_of(lab: Laboratory, second: Second) -> tuple[np.ndarray, np.ndarray, float]:
    """What bodies and the plate's place change of a load, (3, 4 bodies + 2), the nominal load (3,), and its height.

    By the share of a mass [-] and by its centre [m], x, y, z of its own axes, body by body, the root first, then by the
    place. The payload counts in the load, (3,), and in the height, weight times metres, alone.
    """
    model, empty, g = lab.floating, lab.unloaded.floating, float(np.linalg.norm(lab.description.gravity))
    move, data = np.zeros(model.nv), model.createData()
    move[[model.idx_vs[model.getJointId(name)] for name in lab.description.joint_names]] = second.q
    pin.forwardKinematics(model, data, pin.integrate(model, pin.neutral(model), move))
    T_0_root, found = root_in_base(model, lab.description), np.zeros((3, model.njoints - 1, 4))
    u = np.zeros(4)
    for i in range(1, model.njoints):
        body, loaded, T = empty.inertias[i], model.inertias[i], T_0_root * data.oMi[i]
        found[:, i - 1, 0] = body.mass * g * np.append(1.0, T.act(body.lever)[:2])
        found[1:, i - 1, 1:] = body.mass * g * T.rotation[:2]
        u += loaded.mass * g * np.append(1.0, T.act(loaded.lever))
    return np.hstack([found.reshape(3, -1), second.v[0] * np.eye(3)[:, 1:]]), u[:3], float(u[3])


def _tolerances(bodies: int, description: Description) -> np.ndarray:
    """Standard deviations of the columns of `columns_of`."""
    known = description.tolerances
    links = np.tile([known.link_mass, *[known.link_com] * 3], bodies)
    links[1:4] = _ROOT
    return np.append(links, declared_place(description))


def declared_place(description: Description) -> np.ndarray:
    """Standard deviations (2,) [m] of how far a plate is from its declared place under the base."""
    known = description.tolerances
    return np.hypot(known.body(description.base_body)[:2], known.plate_translation)


def seconds_at_rest(
    trial: MeasuredTrial, rest: Rest, robot: Clock, plate: Signal, inverse: Signal | None = None
) -> Iterator[Second]:
    """Seconds of a trial in which no joint moves, the base is seen, and does not swing.

    Args:
        trial: It.
        rest: Where it begins.
        robot: Clock of its readings.
        plate: Wrench by the plate (n, 6), frame 0.
        inverse: The same by inverse dynamics, for u; None: u is left to the nominal robot.
    """
    known, x = np.isfinite(trial.q_motor).all(axis=1), rest.displacement(trial.base.T)[:, _PLANE]
    seen = np.isfinite(x).all(axis=1)
    if not seen.any() or not known.any():
        return
    start, t_seen = float(trial.t_mocap[0]), trial.t_mocap[seen]
    early = t_seen <= start + REST
    moved = x[seen] - x[seen][early if early.any() else slice(None)].mean(axis=0)
    channels = [
        (robot.to_mocap(trial.t_robot[known]), trial.q_motor[known]),
        (plate.t, vertical(plate.x)),
        (t_seen, moved),
    ]
    channels += [] if inverse is None else [(inverse.t, vertical(inverse.x))]
    calm = None
    for begin in np.arange(max(t[0] for t, _ in channels), min(t[-1] for t, _ in channels) - 1.0, 1.0):
        parts = [rows[slice(*np.searchsorted(t, [begin, begin + 1.0]))] for t, rows in channels]
        if min(map(len, parts)) < _FEWEST:
            continue
        swings = parts[1].std(axis=0)
        calm = _CALM * swings if calm is None else calm
        if np.ptp(parts[0], axis=0).max() < _STILL and (swings <= calm).all():
            yield Second(*(rows.mean(axis=0) for rows in parts))


def weighed_links(
    sources: WrenchSources, trials: Sequence[Trial], K: np.ndarray | None, zeros: np.ndarray
) -> tuple[Weighed | None, tuple[Verdict, ...]]:
    """What the robot weighs by calibration trials, None where no plate shows it, and the finding where it is unlikely.

    Args:
        sources: The nominal robot, its clocks, its base's markers.
        trials: Of the dataset.
        K: As of `weighed`.
        zeros: (k,) of the readings.
    """
    lab, robot, found = sources.lab, sources.robot, []
    if robot is None:
        return None, ()
    for trial in trials:
        with suppress(NotEnoughData):
            seen = MeasuredTrial.of(lab.description, trial)
            rest = rest_of(lab.description, seen, sources.T_base_B)
            plate, own = sources.plate_load(seen, rest.T_lab_0).signal, lab.of_trial(trial.id)
            seconds = seconds_at_rest(seen, rest, robot, plate) if len(trial.t_robot) else ()
            found += [(own, second._replace(q=second.q - zeros)) for second in seconds]
    if not found:
        return None, ()
    of = weighed(found, K)
    return (of, ()) if of.likely else (None, (Verdict("weighing", "warning", _OTHERS),))
