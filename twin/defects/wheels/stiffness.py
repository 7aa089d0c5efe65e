"""Stiffness and damping of the base on its wheels, small motions, gravity's part apart.

    K = sum_i A_i' diag(k_i) A_i + diag(0, k_r,i),      A_i = [1, -[p_i]x],      C alike

about the base frame's origin, in its axes, linear then angular. Normal to the floor bushing and contact are in series,
k = k1 k2 / (k1 + k2) and, for slow motion, c = (c1 k2^2 + c2 k1^2) / (k1 + k2)^2. A braked wheel that tilts with the
base keeps its contact point, which then is p_i; one whose bushing twists about all axes stands, and p_i is its hub.
Without bushings friction holds x, y and the rotation about z: their K is infinite.
"""

from collections.abc import Sequence

import numpy as np

from twin.defects.wheels.wheel import Wheel

HELD = (0, 1, 5)
"""Axes that friction holds where there are no bushings: x, y, rz."""


def spatial_stiffness(wheels: Sequence[Wheel]) -> tuple[np.ndarray, np.ndarray]:
    """K and C (6, 6) of wheels that stick to the floor; infinite on the diagonal where nothing is compliant."""
    K, C = np.zeros((6, 6)), np.zeros((6, 6))
    for wheel in wheels:
        A, k, c = lever(wheel), *springs(wheel)
        K += A.T @ np.diag(k) @ A
        C += A.T @ np.diag(c) @ A
    if any(w.bushing is None for w in wheels):
        K[HELD, HELD] = C[HELD, HELD] = np.inf
    return K, C


def lever(wheel: Wheel) -> np.ndarray:
    """A (6, 6): displacement and rotation of the base at the wheel's point."""
    x, y, z = wheel.contact if tilts(wheel) else wheel.centre
    A = np.eye(6)
    A[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return A


def tilts(wheel: Wheel) -> bool:
    """Whether the wheel tilts with the base; one whose bushing twists stands."""
    return wheel.bushing is None or not np.any(wheel.bushing.torsion[:2])


def springs(wheel: Wheel) -> tuple[np.ndarray, np.ndarray]:
    """Stiffnesses and dampings (6,) between base and floor."""
    k, c = np.zeros(6), np.zeros(6)
    if wheel.bushing is not None:
        k, c = wheel.bushing.k, wheel.bushing.c
    if wheel.footing is not None:
        k2, c2 = wheel.footing.stiffness, wheel.footing.damping
        if wheel.bushing is None:
            k[2], c[2] = k2, c2
        else:
            c[2] = (c[2] * k2**2 + c2 * k[2] ** 2) / (k[2] + k2) ** 2
            k[2] = k[2] * k2 / (k[2] + k2)
    return k, c
