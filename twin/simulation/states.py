"""What was true at every step of a simulation."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class States:
    """What was true, at every step of the simulation.

    Attributes:
        t: (n,) [s], 0 at the first set-point.
        motor: Motor-side angles (n, 8) [m, rad].
        link: Link-side angles (n, 8) [m, rad].
        motor_velocity: (n, 8) [m/s, rad/s].
        torque: Of the drives (n, 8) [N, N.m].
        command: Interpolated set-points (n, 8) [m, rad].
        poses: T_lab_link (n, 4, 4) by link.
        wrench: Action of the robot on the plate, lab axes, about the plate's centre (n, 6) [N, N.m].
        plates: Its parts on each plate, about that one's centre (n, n_plates, 6) [N, N.m].
        T_lab_plates: Pose of each plate, its surface centre (n_plates, 4, 4).
        wrist: Action of the hand on the wrist's sensor, its axes, about its origin (n, 6) [N, N.m].
        sensors: Readings (n, k) of further instruments' sensors, by name.
    """

    t: np.ndarray
    motor: np.ndarray
    link: np.ndarray
    motor_velocity: np.ndarray
    torque: np.ndarray
    command: np.ndarray
    poses: dict[str, np.ndarray]
    wrench: np.ndarray
    plates: np.ndarray
    T_lab_plates: np.ndarray
    wrist: np.ndarray
    sensors: dict[str, np.ndarray]

    @classmethod
    def zeros(cls, t: np.ndarray, q: np.ndarray, poses: dict[str, np.ndarray]) -> "States":
        """A robot at joint positions q (n, 8) that exerts no force, with no velocity."""
        n = len(t)
        still, none = np.zeros_like(q), np.zeros((n, 6))
        return cls(
            t, q, q, still, still, q, poses, none, np.zeros((n, 0, 6)), np.eye(4)[None][:0], np.full((n, 6), np.nan), {}
        )
