"""The drive trains of a robot in use: motor readings in, link angles and their intervals out.

    q_link = q_motor - offset - e_m - delta           what the geometry is asked with:  q_motor - e_m - delta
    tau_j <- tau_j - sum_i (M_ji d2 delta_i / dt2 + G_ji delta_i)     links load each other, see `link_streams`

The geometry keeps the zeros of the readings; it is the one fitted to corrected readings (`geometry_refit`).
"""

from dataclasses import dataclass, field, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from calibration.errors import NoSuchElement
from calibration.recording.schema import Description
from calibration.robot.wrist_sensor import Push
from calibration.stages.drive_trains.drive_train import LONGEST, DriveTrain, Quantity, drive_motion
from calibration.stages.drive_trains.friction_shown import friction_shown
from calibration.stages.drive_trains.hung_load import HungLoad, hand_on_floor, hand_on_joints, hanging
from calibration.stages.drive_trains.kernel import link_streams
from calibration.stages.drive_trains.kernel.link_motion import COMPLIANCE, COULOMB, SPRING
from calibration.stages.drive_trains.kernel.link_streams import INERTIA, RESTS, TORQUE, Drives
from calibration.stages.drive_trains.torques import (
    UNWEIGHED,
    Column,
    Dynamics,
    LinkLoads,
    LoadsUnder,
    base_motion,
    dynamics,
    inertial_tolerances,
    inertials,
)
from calibration.stages.suspension.floor_wrench import root_in_base

RUNS = 5  # likely; torque off by -2 and by 2 standard deviations, from either end of what friction holds
_PASSES = 2  # in which links at rest hang from where they were found


class LinkAngles(NamedTuple):
    """Joint angles behind motor readings, zeros of the readings included, all (n, k).

    Attributes:
        q: Motor readings less eccentricity and delta [rad, m].
        low: Least of them, where the side of the mesh is not known.
        high: Largest.
        variance: Of q [rad2].
        moment: (n, 2) about x and y under which a column at rest would lean as it does [N.m].
    """

    q: np.ndarray
    low: np.ndarray
    high: np.ndarray
    variance: np.ndarray
    moment: np.ndarray


@dataclass(frozen=True)
class DriveTrains:
    """Drive trains of a robot and the dynamics that load them.

    Attributes:
        dynamics: From motion to torque, with the declared payload.
        trains: In the order of the measured joints; some joints have none.
        urdf: Text the dynamics were built from.
        description: Of the dataset.
        hung: What else hangs on the wrist's sensor; None where nothing was weighed.
        mass_covariance: (4 b, 4 b) of what a plate weighed of b bodies, see `inertial_tolerances`; empty: nothing.
    """

    dynamics: Dynamics
    trains: tuple[DriveTrain, ...]
    urdf: str
    description: Description
    hung: HungLoad | None = None
    mass_covariance: np.ndarray = field(default_factory=lambda: UNWEIGHED)

    @property
    def joints(self) -> tuple[str, ...]:
        """The measured joints: columns of every q."""
        return self.dynamics.joints

    @property
    def parameters(self) -> tuple[Quantity, ...]:
        """Of all joints."""
        return tuple(q for train in self.trains for q in train.parameters)

    @property
    def inertial_tolerances(self) -> np.ndarray:
        """Covariance (p, p) of the masses and first moments that load joints, see `torques`."""
        known = self.description.tolerances
        return inertial_tolerances(self.dynamics, known.link_mass, known.link_com, self.hung, self.mass_covariance)

    @property
    def inwards(self) -> tuple[DriveTrain, ...]:
        """The drive trains, those nearer to the hand first."""
        order = {self.joints[column]: i for i, column in enumerate(self.dynamics.tree.column)}
        return tuple(sorted(self.trains, key=lambda train: -order[train.joint]))

    def by_joint(self, of_trains: np.ndarray) -> np.ndarray:
        """(k,) of all joints from values (m,) of the drive trains; 0 of joints without one."""
        found = np.zeros(len(self.joints))
        found[[self.joints.index(train.joint) for train in self.trains]] = of_trains
        return found

    def train(self, joint: str) -> DriveTrain:
        """The drive train of a joint.

        Raises:
            NoSuchElement: It has none.
        """
        found = next((train for train in self.trains if train.joint == joint), None)
        if found is None:
            raise NoSuchElement("drive train", joint, [train.joint for train in self.trains])
        return found

    def of_trial(self, trial_id: str) -> "DriveTrains":
        """The same with the payload of one trial of the dataset; of another trial, the campaign's."""
        entry = next((t for t in self.description.trials if t.id == trial_id), None)
        return self if entry is None else self.carrying(entry.payload)

    def carrying(self, mass: float | None) -> "DriveTrains":
        """The same with another mass [kg] of the declared payload."""
        loaded = self.description.carrying(mass)
        if loaded is self.description:
            return self
        return replace(self, description=loaded).built(self.urdf, self.dynamics.column)

    def built(self, urdf: str, column: Column) -> "DriveTrains":
        """The same with dynamics of that URDF, on a column that leans so."""
        built = dynamics(urdf, self.description, self.dynamics.offset, self.hung, column)
        return replace(self, urdf=urdf, dynamics=built)

    def with_offset(self, offset: np.ndarray) -> "DriveTrains":
        """The same with other zeros (k,) of the motor readings."""
        return replace(self, dynamics=replace(self.dynamics, offset=offset))

    def base_motion(
        self, t: np.ndarray, T_lab_base: np.ndarray, at: np.ndarray, by_plate: bool = False
    ) -> np.ndarray | None:
        """`torques.base_motion` by poses (m, 4, 4) of the base frame."""
        T_lab_root = T_lab_base @ root_in_base(self.dynamics.model, self.description).homogeneous
        return base_motion(self.dynamics.gravity, t, T_lab_root, at, by_plate)

    def hand(self, t: np.ndarray, q: np.ndarray, wrist: np.ndarray, base: np.ndarray | None = None) -> Push | None:
        """`hand_on_floor` by the wrist's sensor (n, 6), on a base (n, 12) as of `base_motion`; q may be `swaying`."""
        angles = self.angles(q)[:, : len(self.joints)]
        return hand_on_floor(self.urdf, self.description, self.hung, t, angles, wrist, base)

    def angles(self, q: np.ndarray) -> np.ndarray:
        """Positions as of `swaying` less the zeros of the readings [rad, m]."""
        zeros = np.zeros(q.shape[1])
        zeros[: len(self.joints)] = self.dynamics.offset
        return np.asarray(q - zeros)

    def loads(
        self, trial_id: str, t: np.ndarray, q: np.ndarray, base: np.ndarray | None, wrist: np.ndarray | None
    ) -> LinkLoads:
        """Loads at motor readings q (n, k) on a base as of `Dynamics.loads`, `wrist` as of `weighed`."""
        return self.weighed(t, q, wrist, partial(self.dynamics.loads, trial_id, t, q, base))

    def weighed(self, t: np.ndarray, q: np.ndarray, wrist: np.ndarray | None, loads: LoadsUnder) -> LinkLoads:
        """Loads under what the wrist's sensor (n, 6) shows of a hand on motors, and then on the links."""
        hand, zeros = partial(hand_on_joints, self.urdf, self.description, self.hung, t), self.dynamics.offset
        if wrist is None or (push := hand(q - zeros, wrist)) is None:
            return loads(None, None)
        first = loads(push, None)
        first = replace(first, heavier=self._are_heavier(first))
        links, of = self.likely(first), None
        if not push.outside:
            of = hanging(self.urdf, self.description, self.hung, t, links - zeros, wrist)
        if of is not None:
            first = replace(first, friction=friction_shown(self.under(first).trains, self.joints, first, links, of))
            links = self.likely(first)
        found = loads(hand(links - zeros, wrist), q - links)
        return replace(found, friction=first.friction, heavier=first.heavier)

    def under(self, loads: LinkLoads) -> "DriveTrains":
        """The same as in a trial with these loads: friction that the wrist's sensor shows, and where links begin."""
        share = dict(zip(self.joints, loads.friction, strict=False))
        found = [of.rubbing(share.get(of.joint, 1.0)) for of in self.trains]
        return replace(self, trains=tuple(of.begun_anew() if loads.heavier else of for of in found))

    def _are_heavier(self, loads: LinkLoads) -> bool:
        """Whether the payload is heavier than the campaign's, and its loads are new to a joint."""
        if self.hung is None or self.description.payload_of() <= self.hung.payload:
            return False
        return any(of.is_new(loads.torque[:, self.joints.index(of.joint)]) for of in self.trains)

    def frictions(self, loads: LinkLoads) -> tuple[tuple[str, float, float], ...]:
        """Joint, Coulomb friction under these loads and as calibrated [N.m], where they differ by a tenth."""
        share = dict(zip(self.joints, loads.friction, strict=False))
        shown = [(of.joint, share.get(of.joint, 1.0), float(of.values[COULOMB])) for of in self.trains]
        return tuple((joint, float(s * old), old) for joint, s, old in shown if abs(s - 1.0) > 0.1)

    def likely(self, loads: LinkLoads) -> np.ndarray:
        """Link angles (n, k) of a trial whose loads are known, zeros of the readings included [rad, m]."""
        return self.behind(loads, self._deltas(loads, 1)[: len(self.trains), :, 0])

    def swaying(self, loads: LinkLoads) -> np.ndarray:
        """The same, and in two further columns how a column that bends leans about x and y [rad]."""
        return self.behind(loads, self._deltas(loads, 1)[..., 0])

    def behind(self, loads: LinkLoads, deltas: np.ndarray) -> np.ndarray:
        """The same by how far (m, n) [rad] the links are behind, and the column where it follows."""
        m = len(self.trains)
        q = np.hstack([loads.q.astype(float), -deltas[m:].T])
        for train, delta in zip(self.trains, deltas[:m], strict=True):
            j = self.joints.index(train.joint)
            q[:, j] -= train.harmonics(loads.angle[:, j]) + delta
        return q

    def of_loads(self, loads: LinkLoads) -> LinkAngles:
        """Link angles of a trial whose loads are known."""
        m, found = len(self.trains), self._deltas(loads, RUNS)
        deltas, q = found[:m], self.behind(loads, found[:m, :, 0])
        low, high, variance = q.copy(), q.copy(), np.zeros(q.shape)
        for train, delta in zip(self.trains, deltas, strict=True):
            j, least, most = self.joints.index(train.joint), delta.min(axis=1), delta.max(axis=1)
            low[:, j], high[:, j] = q[:, j] + delta[:, 0] - most, q[:, j] + delta[:, 0] - least
            variance[:, j] = train.variance(least, most, np.abs(loads.v[:, j]) >= RESTS)
        return LinkAngles(q, low, high, variance, swayed(prepared(self), found[m:, :, 0].T, loads.moment))

    def _deltas(self, loads: LinkLoads, runs: int) -> np.ndarray:
        """(m, n, runs) [rad] of each drive train, what its torques are off by taken off as a mesh in contact has it.

        Then of a column that bends.
        """
        if not self.trains:
            return np.zeros((0, len(loads.t), runs))
        drives, states, samples = self.prepared_for(loads, runs)
        found = link_streams.walked(states, loads.t, samples, loads.inertia, loads.stiffness, LONGEST, drives)
        found[:, : len(self.trains)] -= drives.shifts[:, :runs]
        return np.asarray(np.moveaxis(found, 1, 0))

    def prepared_for(self, loads: LinkLoads, runs: int = 1) -> tuple[Drives, np.ndarray, np.ndarray]:
        """What `link_streams` take of a trial: parameters, states (m, runs, 3) at its start, samples (n, 4, m)."""
        under, k = self.under(loads), len(self.joints)
        drives = prepared(under)
        samples = np.zeros((len(loads.t), 4, len(drives.columns)))
        for i, train in enumerate(self.trains):
            j, phi = self.joints.index(train.joint), train.inertials if len(train.inertials) else None
            own = drive_motion([loads], j, phi)
            torque = own.torque + train.link_inertia * own.a
            samples[:, :, i] = np.stack([own.q, own.v, torque, train.moved_inertia(own.inertia)], axis=1)
        for i, c in enumerate(drives.columns[len(self.trains) :], len(self.trains)):
            samples[:, TORQUE, i], samples[:, INERTIA, i] = loads.moment[:, c - k], loads.inertia[:, c, c]
        return drives, begun(under, drives, samples[0, TORQUE], loads.stiffness[0])[:, :runs].copy(), samples


def swayed(drives: Drives, lean: np.ndarray, moment: np.ndarray) -> np.ndarray:
    """Moments (n, 2) under which a column at rest would lean by -lean (n, 2); those on one that does not bend."""
    return moment if not lean.shape[1] else np.asarray(lean / drives.values[-2:, COMPLIANCE])


def begun(trains: DriveTrains, drives: Drives, torques: np.ndarray, G: np.ndarray) -> np.ndarray:
    """States (m, RUNS, 3) of an unknown history under torques (m,) [N.m] at the motors; G (k, k) stiffness."""
    states, G = np.zeros((len(torques), RUNS, 3)), G[np.ix_(drives.columns, drives.columns)]
    for _ in range(_PASSES):
        at_links = torques - G @ states[:, 0, 0]
        for i, (train, torque) in enumerate(zip(trains.trains, at_links, strict=False)):
            low, high = train.ends(torque + drives.offs[i, ::2])
            starts = [*train.begun(torque[None]), *np.column_stack([low, high])[1:].ravel()]
            states[i, :, 0] = states[i, :, 2] = starts
        sways = slice(len(trains.trains), None)
        states[sways, :, 0] = (drives.values[sways, COMPLIANCE] * torques[sways])[:, None]
    return states


def prepared(trains: DriveTrains) -> Drives:
    """Drive trains made ready for their kernels, and the column that carries them where it bends."""
    of, robot = trains.trains, trains.dynamics
    p, m, k = len(inertials(robot)), len(of), len(trains.joints)
    soft = robot.column.compliance if of and (robot.column.compliance > 0.0).all() else np.zeros(0)
    column = np.zeros((len(soft), 7))
    column[:, COMPLIANCE], column[:, SPRING] = soft, 1.0
    own, sways = (np.arange(n, n + len(soft)) for n in (k, m))
    offs = np.array([[0.0, -s, -s, s, s] for s in (2.0 * t.torque_sigma for t in of)]).reshape(-1, RUNS)
    return Drives(
        np.array([*(trains.joints.index(t.joint) for t in of), *own], dtype=np.int64),
        np.array([*([t.joint for t in of].index(t.joint) for t in trains.inwards), *sways], dtype=np.int64),
        np.array([*(t.simulated_values for t in of), *column]).reshape(-1, 7),
        np.array([t.inertials if len(t.inertials) else np.zeros(p) for t in of]).reshape(-1, p),
        np.array([t.link_inertia for t in of], dtype=float),
        np.array([*(t.dynamic for t in of), *(soft > 0.0)], dtype=bool),
        offs,
        offs * np.array([t.values[COMPLIANCE] for t in of])[:, None],
        np.array([t.motor for t in of]).reshape(-1, 4),
        np.array([*(not t.dynamic and t.form == "dead_zone" for t in of), *(soft < 0.0)], dtype=bool),
        np.array([[t.doubt**2 / 12.0, t.doubt_at_rest**2 / 12.0, t.residual**2] for t in of]).reshape(-1, 3),
        np.array(robot.offset, dtype=float),
        np.array(robot.column, dtype=float),
    )
