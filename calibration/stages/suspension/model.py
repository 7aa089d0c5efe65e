"""The base on its wheels as a model of prediction: wrench in, displacement of the base out.

    (K + G) x + C dx/dt + M d2x/dt2 = w          see wheels, base_response

K, C are small-signal stiffness and damping about the origin of frame 0 in its axes, gravity's part not in them. An axis
that the springs do not predict better than a base at rest is taken at rest.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from calibration.errors import ShapeError
from calibration.inference.parameters import Combination, Parameter
from calibration.numerics.signals import RATE, interpolate_columns
from calibration.stages.suspension.base_response import Forcing
from calibration.stages.suspension.cross_validation import HeldOut
from calibration.stages.suspension.modal_response import Modes, modes_of, predicted

Source = Literal["plate", "dynamics"]
AXES = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True)
class Suspension:
    """A fitted suspension.

    Attributes:
        form: `printed`, or `compliance` where the printed form was refused.
        K: (6, 6) stiffness [N/m, N, N.m/rad].
        C: (6, 6) damping [N.s/m, N.s, N.m.s/rad].
        tangent: (6, 6) of preload, for wrenches on the floor.
        gravity: (6, 6) stiffness that the robot's weight adds, of the nominal robot; not in K. Zeros where there are no
            joint readings of its posture.
        held_out: Leave-one-trial-out, one for each source that was tried.
        parameters: `suspension.{K,C}.<i><j>`, i <= j of x y z rx ry rz as 1 to 6, then those of wheels.
        combinations: Of the wheels' parameters, as far as one wrench identifies them; coefficients in the order of
            `parameters`.
    """

    form: Literal["printed", "compliance"]
    K: np.ndarray
    C: np.ndarray
    tangent: np.ndarray
    gravity: np.ndarray
    held_out: tuple[tuple[Source, HeldOut], ...]
    parameters: tuple[Parameter, ...]
    combinations: tuple[Combination, ...]

    def __post_init__(self) -> None:
        for name, value in (("K", self.K), ("C", self.C), ("tangent", self.tangent), ("gravity", self.gravity)):
            if value.shape != (6, 6) or not np.isfinite(value).all():
                raise ShapeError(f"finite {name}", value.shape, (6, 6))

    @cached_property
    def modes(self) -> Modes:
        """Modes of the base under wrenches on the floor."""
        return modes_of(self.K + self.tangent, self.C, np.zeros((6, 6)))

    def moves(self, source: Source) -> np.ndarray:
        """(6,) axes that are moved when the wrench comes from a source; none where it was not tried."""
        return self._moves.get(source, np.zeros(6, dtype=bool))

    @cached_property
    def _moves(self) -> dict[Source, np.ndarray]:
        return {source: h.moves for source, h in reversed(self.held_out)}

    def displacement(self, t: np.ndarray, wrench: np.ndarray) -> np.ndarray:
        """Displacement of the base (n, 6) [m, rad] at t (n,) [s] under changes since rest of the plate's wrench (n, 6).

        Frame 0, small motions; between samples the wrench is linear.
        """
        if wrench.shape != (len(t), 6):
            raise ShapeError("wrench", wrench.shape, (len(t), 6))
        grid = t[0] + np.arange(int(np.ceil((t[-1] - t[0]) * RATE - 1e-6)) + 1) / RATE
        w = interpolate_columns(grid, t, wrench)
        none = np.zeros((6, 6))
        x = self.displaced(Forcing(grid, w, np.zeros(6), none, self.tangent, np.eye(4)), "plate")
        return interpolate_columns(t, grid, x)

    def displaced(self, forcing: Forcing, source: Source) -> np.ndarray:
        """Displacement (n, 6) [m, rad] under a forcing, axes that are not moved at zero."""
        return predicted(self.K, self.C, forcing) * self.moves(source)
