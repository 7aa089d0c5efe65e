"""Drive train of one joint: motor reading in, link angle and its interval out.

    q_link = q_motor - offset - e_m(theta) - delta            e(theta) = cos1 cos + sin1 sin + cos2 cos 2 + sin2 sin 2
    link reading = q_link + offset_l + e_l(theta)             phases in the joint's angle theta

delta is the state of the dead zone (`link_motion`). Where the motion before the first reading is unknown, delta is
anywhere in what friction holds at rest, [D(tau - f_c), D(tau + f_c)]: both ends are carried along, and what is between
them is the interval of the link's angle. They meet once the drive has been moved through its gap or its load has
decided the side. A torque that is wrong by two standard deviations either way widens the interval where it would change
the side.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from calibration.stages.drive_trains.kernel.link_motion import (
    COMPLIANCE,
    COULOMB,
    HALF_GAP,
    LIGHT,
    VISCOUS,
    Drive,
    played,
    simulated,
)
from calibration.stages.drive_trains.torques import LinkLoads

Form = Literal["dead_zone", "friction_held"]
Status = Literal["estimated", "not_identifiable"]
VALUES = ("half_gap", "compliance", "coulomb", "viscous", "relaxation", "spring", "slip")
HARMONICS = ("cos1", "sin1", "cos2", "sin2")
LONGEST = 3.4e-3  # [s] step of the link's motion
_NEW = 0.1  # of the friction, by which a load is beyond those of the calibration
_FRICTIONLESS = 1e-9  # [N.m] friction that holds nothing
_RIGID = 1e-7  # [rad/(N.m)] least compliance that is simulated


@dataclass(frozen=True)
class Quantity:
    """A parameter of a drive train.

    Attributes:
        name: As in the contract.
        unit: SI.
        value: Estimate.
        sigma: Standard deviation, priors included.
        status: Whether the data fix it.
        remedy: The motion that would, where they do not.
    """

    name: str
    unit: str
    value: float
    sigma: float
    status: Status
    remedy: str = ""


@dataclass(frozen=True)
class DriveTrain:
    """Drive train of one joint.

    Attributes:
        joint: Name.
        form: `dead_zone`: the load decides the side; `friction_held`: motion does, and the mesh slips.
        values: (7,) half gap [rad], compliance [rad/(N.m)], Coulomb [N.m] and viscous [N.m.s/rad] friction, relaxation
            time of the contact [s], spring [N.m/rad] and slip [N.m] of the mesh's friction.
        link_inertia: Of the output gear, beside the nominal links' [kg.m2].
        dynamic: Whether the link's inertia counts; else delta follows the torque at once.
        motor: (4,) eccentricity of the motor encoder at the joint, cos1, sin1, cos2, sin2 [rad].
        link: (5,) offset of the link encoder from the motor's, and its eccentricity [rad]; NaN without one.
        start: Share of [D(tau - f_c), D(tau + f_c)] at which trials start, mean and standard deviation [-]; NaN where
            no trial shows it, see `begun`.
        torque_sigma: Standard deviation of the torque at which the side changes [N.m].
        residual: Rms of what the model left of trials left out, in motion, where the side of the mesh is certain [rad].
        doubt: The same where it is not, over the standard deviation of an even distribution between both ends [-]; of
            joints with link encoders what predictions in use left, see `errors_in_use`.
        doubt_at_rest: The same where it has stopped.
        inertials: (p,) masses and first moments, less the nominal ones, that this joint's load identifies, in the order
            of `torques.inertials` [kg, kg.m]; empty: nominal.
        parameters: What is reported, with standard deviations.
        range: (2,) least and largest nominal torque of the trials it was found in [N.m]; NaN where not known.
    """

    joint: str
    form: Form
    values: np.ndarray
    link_inertia: float = 0.0
    dynamic: bool = True
    motor: np.ndarray = field(default_factory=lambda: np.zeros(4))
    link: np.ndarray = field(default_factory=lambda: np.full(5, np.nan))
    start: tuple[float, float] = (np.nan, np.nan)
    torque_sigma: float = 0.05
    residual: float = 0.0
    doubt: float = 1.0
    doubt_at_rest: float = 1.0
    inertials: np.ndarray = field(default_factory=lambda: np.zeros(0))
    parameters: tuple[Quantity, ...] = ()
    range: np.ndarray = field(default_factory=lambda: np.full(2, np.nan))

    @property
    def gap(self) -> float:
        """Total backlash [rad]."""
        return 2.0 * float(self.values[HALF_GAP])

    def begun(self, torque: np.ndarray) -> np.ndarray:
        """Expected delta (m,) [rad] where trials begin under torques (m,) [N.m].

        Where no trial shows the share it is c tau + g tau / f_c in the gap: a load that wandered to tau was last beyond
        +f_c, not beyond -f_c, and left the link there, with probability (1 + tau / f_c) / 2 (gambler's ruin).
        """
        if np.isfinite(self.start[0]):
            low, high = self.ends(torque)
            return np.asarray(low + self.start[0] * (high - low))
        side = np.clip(torque / max(self.values[COULOMB], _FRICTIONLESS), -1.0, 1.0)
        return np.asarray(self.values[COMPLIANCE] * torque + self.values[HALF_GAP] * side)

    def variance(self, low: np.ndarray, high: np.ndarray, moves: np.ndarray) -> np.ndarray:
        """Variance (n,) [rad2] of a link that is between low and high (n,) [rad], its motor in motion (n,) or not."""
        doubt = np.where(moves, self.doubt, self.doubt_at_rest)
        return np.asarray(doubt**2 * (high - low) ** 2 / 12.0 + self.residual**2)

    def beyond(self, torque: np.ndarray) -> np.ndarray:
        """By how much nominal torques (...) [N.m] exceed those it was found by; all of them where those are unknown."""
        low, high = np.nan_to_num(self.range)
        return np.asarray(torque - np.clip(torque, low, high))

    def rubbing(self, share: float) -> "DriveTrain":
        """The same with so many times the friction and so much less compliance: it winds the mesh up as before."""
        values = self.values.copy()
        values[[COULOMB, VISCOUS]] *= share
        values[COMPLIANCE] /= share
        return replace(self, values=values)

    def begun_anew(self) -> "DriveTrain":
        """The same under a payload heavier than the calibration's, whose trials do not show where links begin then."""
        return replace(self, start=(np.nan, np.nan))

    def is_new(self, torque: np.ndarray) -> bool:
        """Whether nominal torques (n,) [N.m] exceed those it was found by, by more than a tenth of its friction."""
        return bool(np.abs(self.beyond(torque)).max() > _NEW * self.values[COULOMB])

    def ends(self, torque: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest delta (m,) [rad] at which friction holds the link under torques (m,) [N.m]."""
        g, c, f = self.values[HALF_GAP], self.values[COMPLIANCE], self.values[COULOMB]
        low, high = torque - f, torque + f
        return c * low + g * np.sign(low), c * high + g * np.sign(high)

    def flanks(self, drive: "DriveMotion") -> tuple[np.ndarray, np.ndarray]:
        """delta (n,) [rad] on the lower and on the upper side of the gap, in contact."""
        wound = self.values[COMPLIANCE] * (drive.torque + self.link_inertia * drive.a)
        return wound - self.values[HALF_GAP], wound + self.values[HALF_GAP]

    def harmonics(self, angle: np.ndarray) -> np.ndarray:
        """Eccentricity e_m (n,) [rad] of the motor encoder at joint angles (n,) [rad]."""
        return harmonic_terms(angle) @ self.motor

    def deltas(
        self, drive: "DriveMotion", torque: np.ndarray, starts: np.ndarray, longest: float = LONGEST
    ) -> np.ndarray:
        """delta (n,) [rad] under torques (n,) [N.m], from `starts` (m,) where trials begin; steps of `longest` [s]."""
        alone = np.zeros(len(drive.q))
        if not self.dynamic and self.form == "dead_zone":
            own = Drive(drive.t, drive.q, drive.v, torque, drive.inertia, alone)
            return np.asarray(played(own, drive.begins, starts, self.values))
        own = Drive(drive.t, drive.q, drive.v, torque, self.moved_inertia(drive.inertia), alone)
        return np.asarray(simulated(own, drive.begins, starts, longest, self.simulated_values))

    def moved_inertia(self, nominal: np.ndarray) -> np.ndarray:
        """What the mesh moves (n,) [kg.m2], as the simulation has it, where it nominally moves (n,)."""
        inertia = np.maximum(nominal + self.link_inertia, LIGHT)
        return inertia if self.dynamic else np.full(len(nominal), LIGHT)

    @property
    def simulated_values(self) -> np.ndarray:
        """`values` with a compliance that can be simulated."""
        values = self.values.copy()
        values[COMPLIANCE] = max(values[COMPLIANCE], _RIGID)
        return values


@dataclass(frozen=True)
class DriveMotion:
    """What one motor did in m trials of n samples in all, in a row, and its load; all (n,) unless stated otherwise.

    Attributes:
        t: [s].
        q: Motor readings [rad].
        v: [rad/s].
        a: [rad/s2].
        torque: Of the link's motion if it followed the motor [N.m].
        inertia: The mesh moves [kg.m2].
        begins: (m + 1,) first sample of each trial, and n.
    """

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    torque: np.ndarray
    inertia: np.ndarray
    begins: np.ndarray


def drive_motion(loads: Sequence[LinkLoads], column: int, inertials: np.ndarray | None = None) -> DriveMotion:
    """Motion of a joint in trials, with other masses and first moments (p,) where they are given."""

    def joined(name: str) -> np.ndarray:
        return np.concatenate([getattr(of_trial, name)[:, column] for of_trial in loads])

    t, torque = np.concatenate([of_trial.t for of_trial in loads]), joined("torque")
    inertia = np.concatenate([of_trial.inertia[:, column, column] for of_trial in loads])
    if inertials is not None:
        torque = torque + joined("regressor") @ inertials
    begins = np.cumsum([0, *(len(of_trial.t) for of_trial in loads)])
    return DriveMotion(t, joined("q"), joined("v"), joined("a"), torque, inertia, begins)


def harmonic_terms(angle: np.ndarray) -> np.ndarray:
    """cos, sin, cos 2, sin 2 (n, 4) of angles (n,) [rad]."""
    return np.stack([np.cos(angle), np.sin(angle), np.cos(2.0 * angle), np.sin(2.0 * angle)], axis=1)
