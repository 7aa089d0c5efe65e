"""What `Compensator` returns: poses of the hand with their covariance, and the state after a sample."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from calibration.errors import NotEnoughData
from calibration.inference.parameters import Model
from calibration.numerics.signals import interpolate_columns
from calibration.prediction.base_pose import BaseState, LoadedBase
from calibration.prediction.bundled_arm import ArmState
from calibration.recording.clock import Clock
from calibration.robot.hand import HandModel
from calibration.robot.nominal_frames import AXES, PREFIX, first_joint, placement_derivative

_SPACING, _SPAN = 0.05, 1.0  # [s] between samples at most, and of all of them at least, for velocities


class RobotState(NamedTuple):
    """State after a sample.

    Attributes:
        arm: Its drive trains; None where the estimate has none.
        base: The base under a wrench; None without one.
    """

    arm: ArmState | None = None
    base: BaseState | None = None


@dataclass(frozen=True)
class HandPose:
    """Predicted poses of the hand body.

    Attributes:
        T: (n, 4, 4) in the lab, or in the base frame at rest where the base's pose was not given.
        uncertainty: Computes `covariance`, which costs more than the pose.
        state: For the next step; None of a recording.
    """

    T: np.ndarray
    uncertainty: Callable[[], np.ndarray]
    state: RobotState | None = None

    @cached_property
    def covariance(self) -> np.ndarray:
        """(n, 6, 6) of the local twist [m, rad], for a base frame located by its own markers; when first asked for."""
        return self.uncertainty()


def needed(base: LoadedBase | None) -> LoadedBase:
    """The base.

    Raises:
        NotEnoughData: There is none.
    """
    if base is None:
        raise NotEnoughData("this estimate has no suspension for a wrench to move: leave the wrench out")
    return base


def at_readings(t: np.ndarray, clocks: Sequence[Clock], t_wrench: np.ndarray, wrench: np.ndarray) -> np.ndarray:
    """Wrenches (n, 6), linear, at the times t (n,) [s] of readings from those (m, 6) at t_wrench (m,) [s].

    t is on the robot's clock, t_wrench on the plate's; clocks are those of both on the motion capture's.

    Raises:
        NotEnoughData: A clock is not known, or readings were taken before the first or after the last wrench.
    """
    clock = {c.instrument: c for c in clocks}
    if missing := sorted({"robot", "plate"} - clock.keys()):
        raise NotEnoughData(f"clock of {missing} not known: pass the wrench at the times of the readings")
    at = clock["plate"].from_mocap(clock["robot"].to_mocap(t))
    beyond = max(float(t_wrench[0] - at[0]), float(at[-1] - t_wrench[-1]))
    if beyond > 1e-9:  # [s] rounding
        raise NotEnoughData(
            f"wrenches end {beyond:.3g} s before the readings do, or begin after them; cut the readings"
        )
    return interpolate_columns(at, t_wrench, wrench)


def in_lab(
    in_base: HandPose,
    base: LoadedBase | None,
    T_lab_base: np.ndarray | None,
    moved: bool,
    variance: Callable[[], np.ndarray] | None = None,
    state: RobotState | None = None,
) -> HandPose:
    """A pose in the base frame from where the base is (n, 4, 4), which may have `moved`, of variance (6,) or (n, 6)."""

    def covariance() -> np.ndarray:
        if base is not None and variance is not None:
            return in_base.covariance + base.carried(variance(), in_base.T)
        if base is not None and T_lab_base is not None:
            return in_base.covariance + base.covariance(in_base.T, moved)
        return in_base.covariance

    return HandPose(in_base.T if T_lab_base is None else T_lab_base @ in_base.T, covariance, state)


def uncertain(hand: HandModel, model: Model) -> tuple[tuple[str, ...], np.ndarray]:
    """Parameters of the hand that a model estimates, and their covariance (p, p)."""
    known, chain = [p.name for p in model.parameters], hand.nominal
    arm = [known.index(f"{PREFIX}.{axis}") for axis in AXES if f"{PREFIX}.x" in known]
    placement = [f"geometry.{first_joint(chain)}.{axis}" for axis in AXES if arm]
    names = tuple(name for name in hand.names if name in known or name in placement)
    G = np.array([[float(name == other) for other in known] for name in names]).reshape(len(names), len(known))
    if arm:
        vector = np.array([model.parameters[i].value for i in arm])
        G[np.ix_([names.index(name) for name in placement], arm)] = placement_derivative(chain, vector)
    return names, np.asarray(G @ model.random_covariance @ G.T)


def placed(T_lab_base: np.ndarray | None, moved: np.ndarray | None, n: int) -> np.ndarray | None:
    """The base (n, 4, 4) from its pose at the start and how it moved in the lab; None where neither is known."""
    if T_lab_base is None:
        return moved
    start = np.asarray(T_lab_base, dtype=float)
    return start[None].repeat(n, axis=0) if moved is None else moved @ start


def continuous(t: np.ndarray) -> bool:
    """Whether readings are many and close enough to have velocities."""
    steps = np.diff(t)
    return len(t) > 1 and steps.min() > 0.0 and steps.max() <= _SPACING and t[-1] - t[0] >= _SPAN
