"""Readings of both sides of the gears, which stand for a trial."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Readings:
    """Of a trial, both sides, the motors' corrected."""

    q_motor: np.ndarray
    q_link: np.ndarray
