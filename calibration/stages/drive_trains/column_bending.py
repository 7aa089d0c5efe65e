"""Bending of the column that carries the arm, from two marker bodies, and what it does to the hand.

    rotation vector of R_B_S(n) = constant - c M(n)          M = (M_x, M_y) that the column bears, its frame [N.m]
    T_base_hand = T_base_column exp(-c M) T_base_column^-1 T_base_hand(rigid)

c (2,) [rad/(N.m)] about x and y, by least squares over static postures of a marker body S beyond the first joint, as
the base's body B sees it. Where no such body is seen the column is rigid.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from calibration.errors import NotEnoughData
from calibration.mocap.postures import dwell_windows, mean_poses
from calibration.numerics.lie import compose, from_vector, inverse, rotation_vector
from calibration.recording.clock import Clock
from calibration.recording.schema import Body, Description
from calibration.recording.trial import Trial
from calibration.robot.chain import Chain
from calibration.robot.hand import HandModel
from calibration.stages.drive_trains.drive_train import Quantity
from calibration.stages.drive_trains.torques import Column, LinkLoads

_FEWEST = 8  # postures
_SPREAD = 3.0  # [N.m] least range of the moments


@dataclass(frozen=True)
class ColumnBending:
    """Compliance of the column.

    Attributes:
        joint: The first joint of the chain.
        compliance: (2,) about x and y of its frame [rad/(N.m)].
        sigma: (2,) standard deviations.
        mean: (2,) moments of the postures [N.m]: what the column turns by there, the geometry takes up.
    """

    joint: str
    compliance: np.ndarray
    sigma: np.ndarray
    mean: np.ndarray = field(default_factory=lambda: np.zeros(2))

    @property
    def column(self) -> Column:
        """How it leans under a moment, where the geometry is without that of its postures."""
        return Column(self.compliance, np.zeros(2))

    def turns(self, moment: np.ndarray) -> np.ndarray:
        """Rotation vectors (n, 3) [rad] of what the column carries, in its frame, under moments (n, 2) [N.m]."""
        turn = np.zeros((len(moment), 3))
        np.multiply(moment, -self.compliance, out=turn[:, :2])
        return turn

    def parameters(self, link: str, off: float) -> tuple[Quantity, ...]:
        """Stiffness about both axes, of the column's link; `off`: share [-] by which moments err, one sigma.

        Predictions have the same moments: there the share cancels.
        """
        found = []
        for axis, c, s in zip(("krx", "kry"), self.compliance, self.sigma, strict=True):
            known = c > 3.0 * s
            k, sigma = (1.0 / c, float(np.hypot(s / c, off)) / c) if known else (np.inf, np.inf)
            remedy = (
                "" if known else "hold the arm stretched out forwards and sideways in sight of the shoulder's markers"
            )
            status = "estimated" if known else "not_identifiable"
            found.append(
                Quantity(f"flexibility.{link}.{axis}", "N.m/rad", float(k), float(sigma), status, remedy)  # type: ignore
            )
        return tuple(found)


def rigid(joint: str) -> ColumnBending:
    """A column that does not bend."""
    return ColumnBending(joint, np.zeros(2), np.full(2, np.inf))


def column_bending(
    description: Description, trials: Sequence[Trial], loads: Sequence[LinkLoads], robot: Clock, hand: HandModel
) -> ColumnBending:
    """The bending seen in the dwells of trials; loads of the same trials."""
    joint, body = hand.chain.joints[0], _carried_body(description, hand)
    if body is None:
        return rigid(joint)
    rows = [
        row for t, load in zip(trials, loads, strict=True) for row in _seen(description, body, t, load, robot, hand)
    ]
    if len(rows) < _FEWEST or np.ptp(np.array(rows)[:, 2:], axis=0).max() < _SPREAD:
        return rigid(joint)
    turn, M = np.array(rows)[:, :2], np.array(rows)[:, 2:]
    found = [_line(-M[:, k], turn[:, k]) for k in range(2)]
    return ColumnBending(joint, np.array([c for c, _ in found]), np.array([s for _, s in found]), M.mean(axis=0))


def leaning(bending: ColumnBending, chain: Chain, description: Description) -> np.ndarray:
    """(2,) [rad] standard deviations of how far the column leans in all postures alike, unknown to M.

    Its own weight acts at a centre of mass that is known to a tolerance. Geometry takes that lean for a placement.
    """
    own = chain.nominal.inertias[chain.nominal.getJointId(bending.joint)]
    moment = own.mass * np.linalg.norm(description.gravity) * description.tolerances.link_com
    return np.asarray(bending.compliance * moment)


def bent(hand: HandModel, bending: ColumnBending, q: np.ndarray, moment: np.ndarray) -> np.ndarray:
    """T_B_H (n, 4, 4) at link angles q (n, n_measured) with the column bent under moments (n, 2)."""
    return hand.poses(q, bending.turns(moment))


def moved(hand: HandModel, bending: ColumnBending, q: np.ndarray, moment: np.ndarray) -> np.ndarray:
    """The motion (n, 4, 4) of all the column carries, in the base's marker body."""
    T_base_column = hand.chain.poses(hand.angles(q), bending.joint)
    T_B_base = inverse(_base(hand))
    turn = compose(Rotation.from_rotvec(bending.turns(moment)).as_matrix(), np.zeros((len(q), 3)))
    return np.asarray(T_B_base @ T_base_column @ turn @ inverse(T_base_column) @ _base(hand))


def _base(hand: HandModel) -> np.ndarray:
    return from_vector(hand.base)


def _carried_body(description: Description, hand: HandModel) -> Body | None:
    """A marker body on the first joint's own link."""
    model = hand.chain.nominal
    known = (description.base_body.name, description.hand_body.name)
    first = model.getJointId(hand.chain.joints[0])
    for body in description.bodies:
        if body.name not in known and model.frames[model.getFrameId(body.link)].parentJoint == first:
            return body
    return None


def _seen(
    description: Description, body: Body, trial: Trial, loads: LinkLoads, robot: Clock, hand: HandModel
) -> Iterator[np.ndarray]:
    """Rotation about the column's x and y, and moments, (4,) of each dwell that shows both bodies."""
    t_robot = robot.to_mocap(loads.t)
    dwells = [
        ((t_robot >= start) & (t_robot <= stop), np.flatnonzero((trial.t_mocap >= start) & (trial.t_mocap <= stop)))
        for start, stop in dwell_windows(trial)
    ]
    dwells = [(rows, seen) for rows, seen in dwells if rows.any() and len(seen)]
    if not dwells:
        return
    try:
        both = (mean_poses(b, trial, [seen for _, seen in dwells]).T for b in (description.base_body, body))
        poses = list(zip(*both, strict=True))
    except NotEnoughData:
        return
    for (rows, _), (base, other) in zip(dwells, poses, strict=True):
        R_base_S = _base(hand)[:3, :3] @ base[:3, :3].T @ other[:3, :3]
        R_base_column = hand.chain.poses(loads.q[rows][:1], hand.chain.joints[0])[0, :3, :3]
        turn = rotation_vector((R_base_column.T @ R_base_S @ _nominal(description, body, hand).T)[None])[0]
        if np.isfinite(turn).all():
            yield np.append(turn[:2], loads.moment[rows].mean(axis=0))


def _nominal(description: Description, body: Body, hand: HandModel) -> np.ndarray:
    """Nominal R_column_S (3, 3)."""
    model = hand.chain.nominal
    frame = model.frames[model.getFrameId(body.link)]
    return np.asarray(frame.placement.rotation @ from_vector(np.array(body.placement))[:3, :3])


def _line(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Slope and its standard deviation."""
    dx, dy = x - x.mean(), y - y.mean()
    total = max(float(dx @ dx), np.finfo(float).tiny)
    slope = float(dx @ dy) / total
    left = dy - slope * dx
    return slope, float(np.sqrt((left @ left) / max(1, len(x) - 2) / total))
