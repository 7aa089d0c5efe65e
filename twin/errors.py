"""What can go wrong in a simulation."""

from collections.abc import Iterable


class TwinError(Exception):
    """Root of every error of this package."""


class UnknownElement(TwinError):
    """A name that is not in the model."""

    def __init__(self, kind: str, name: str, known: Iterable[str]) -> None:
        self.name = name
        super().__init__(f"no {kind} named {name!r}; the model has {sorted(known)}")


class Diverged(TwinError):
    """The simulation diverged: a state is not finite, or implausibly fast.

    Attributes:
        trial: The trial concerned.
        time: When it happened [s from the first set-point; negative while the robot settles].
        joint: The first joint whose state is not finite.
    """

    def __init__(self, trial: str, time: float, joint: str) -> None:
        self.trial, self.time, self.joint = trial, time, joint
        super().__init__(
            f"trial {trial!r} diverged at {time:.3f} s in joint {joint!r}; "
            "lower the stiffness named by that joint or the time step"
        )


class RobotFell(TwinError):
    """A robot that tipped over or left its plate."""


class BaseVibrates(TwinError):
    """The base vibrates before its trial: the solver overshoots at every step.

    Attributes:
        trial: The trial concerned.
        joint: What vibrates most, by its kinetic energy; `root`: the base itself.
    """

    def __init__(self, trial: str, flips: tuple[float, float], joint: str) -> None:
        self.trial, self.joint = trial, joint
        super().__init__(
            f"trial {trial!r}: the base vibrates before the motion, from step to step by {flips[0]:.2g} m/s2 and "
            f"{flips[1]:.2g} rad/s2, most of all joint {joint!r}; lower the stiffness or damping named by that "
            "joint (root: of the wheels or their contacts) or the time step"
        )


class Unreachable(TwinError):
    """A motion that the robot cannot make."""
