"""One robot in its laboratory."""

from dataclasses import dataclass

import numpy as np

from twin.build import Twin
from twin.config import TwinConfig
from twin.draw import Robot

EPOCH = 100.0  # [s] on the mocap clock when the first trial starts


@dataclass(frozen=True)
class Laboratory:
    """One robot in its laboratory.

    Attributes:
        config: What the scenario says, its uncertain values drawn.
        seed: Root of every random stream.
        robot: The drawn robot.
        twin: Its model.
        T_lab_base: Where it is put down (4, 4).
    """

    config: TwinConfig
    seed: int
    robot: Robot
    twin: Twin
    T_lab_base: np.ndarray
