"""The swings of the campaign: all joints on sines, at one frequency for calibration, at unequal ones for validation.

q_j(s) = c_j + A_j (sin(2 pi f_j s + phi_j) - sin phi_j)
"""

from dataclasses import dataclass

import numpy as np

from twin.fields.names import ARM, TORSO

JOINTS = (TORSO, *ARM)
TAU = 2.0 * np.pi
# arm_1 = 1.5: arm forward, 0.3: to the right. arm_2 > 0 lifts the upper arm, arm_3 = -1.57 turns the elbow outwards.
FORWARD = (0.12, 1.50, 0.10, -1.55, 0.60, 0.10, 0.10, 0.10)
_SIDE = (0.12, 0.35, 0.10, -1.55, 0.60, 0.10, 0.10, 0.10)
# Never seen in calibration: all joints at once at unequal frequencies, and its mirror image.
_XYZ_FREQUENCY = (0.16, 0.20, 0.23, 0.17, 0.26, 0.19, 0.31, 0.22)


@dataclass(frozen=True)
class Swing:
    """A periodic motion: centre, amplitude, frequency and phase of each joint.

    Attributes:
        start: Posture (8,) at s = 0 [m, rad].
        amplitude: (8,) [m, rad].
        frequency: (8,) [Hz].
        phase: (8,) [rad].
        halts: Whether it stops after each period of its lowest frequency.
    """

    start: tuple[float, ...]
    amplitude: tuple[float, ...]
    frequency: tuple[float, ...]
    phase: tuple[float, ...]
    halts: bool = False

    def at(self, s: np.ndarray) -> np.ndarray:
        """Path (n, 8) at path times s (n,) [s]."""
        c, A, f, phi = (np.array(v) for v in (self.start, self.amplitude, self.frequency, self.phase))
        return c + A * (np.sin(TAU * f * s[:, None] + phi) - np.sin(phi))


VALIDATION_SWINGS = {
    "xyz": Swing(
        (0.15, 1.30, 0.0, -1.60, 0.85, 0.0, 0.5, 0.0),
        (0.03, 0.45, 0.35, 0.40, 0.40, 0.6, 0.45, 0.6),
        _XYZ_FREQUENCY,
        (0.0, 0.0, 0.5, 1.0, 0.3, 0.8, 0.2, 1.2),
    ),
    "xyz_mirror": Swing(
        (0.15, 1.30, 0.0, -1.60, 0.85, 0.0, 0.5, 0.0),
        (0.03, -0.45, 0.35, -0.40, -0.40, -0.6, -0.45, -0.6),
        _XYZ_FREQUENCY[::-1],
        (0.0, 0.0, 0.9, 0.4, 1.1, 0.2, 0.7, 0.1),
    ),
}

FURTHER_SWINGS: dict[str, Swing] = {}
"""Swings that are recorded where a campaign's `only` names them, in the role of validation."""


def in_step(frequency: float, start: tuple[float, ...], amplitudes: tuple[float, ...], halts: bool = False) -> Swing:
    """A swing of all joints at one frequency [Hz] and without phase."""
    n = len(JOINTS)
    return Swing(start, amplitudes, (frequency,) * n, (0.0,) * n, halts)


# The paper's families: about each axis of the base, folding along two of them. 0.2 Hz, wrists moving along. Starting
# and ending, around_z brings the drive wheels nearer their friction than any validation swing does: it does so often.
CALIBRATION_SWINGS = {
    "around_x": in_step(0.2, _SIDE, (0.0, 0.0, 0.55, 0.0, 0.0, 0.5, -0.4, 0.5)),
    "around_y": in_step(0.2, FORWARD, (0.0, 0.0, 0.55, 0.0, 0.0, -0.5, 0.4, 0.5)),
    "around_z": in_step(0.2, FORWARD, (0.0, 1.00, 0.0, 0.0, 0.0, 0.5, 0.4, -0.5), halts=True),
    "x_fold": in_step(0.2, (0.12, 1.5, -0.55, -3.0, 1.3, 0.1, 0.1, 0.1), (0.0, 0.0, 0.45, 0.0, -0.7, 0.4, -0.5, 0.4)),
    "y_fold": in_step(0.2, (0.12, 0.4, -0.55, -3.0, 1.3, 0.1, 0.1, 0.1), (0.0, 0.0, 0.45, 0.3, -0.7, -0.4, -0.5, 0.4)),
}
