"""Where a plate is pressed: its centre of pressure, which means nothing while the plate carries next to nothing.

    CoP = c + (-m_y / f_z, m_x / f_z, 0)        wrench (f, m) about the surface centre c, lab axes, z up

Action and reaction have the same one. Noise of sigma_m in the moments moves it by sigma_m / |f_z|.
"""

import numpy as np

LOADED = 20.0
"""Least |f_z| [N] for which there is a centre of pressure."""


def centre_of_pressure(wrench: np.ndarray, centre: np.ndarray, least: float = LOADED) -> np.ndarray:
    """Centres of pressure (n, 3) [m, lab], NaN where the plate is not loaded.

    Args:
        wrench: (n, 6) [N, N.m], lab axes, about `centre`.
        centre: Surface centre of the plate (3,) [m, lab].
        least: |f_z| [N] from which on the plate counts as loaded.
    """
    f, m = wrench[:, :3], wrench[:, 3:]
    f_z = np.where(np.abs(f[:, 2]) > least, f[:, 2], np.nan)
    return np.asarray(np.stack([-m[:, 1] / f_z, m[:, 0] / f_z, 0.0 * f_z], axis=1) + np.asarray(centre))


def in_frame(wrench: np.ndarray, centre: np.ndarray, T_lab_0: np.ndarray) -> np.ndarray:
    """Sum (n, 6) [N, N.m, frame 0] of wrenches (n, p, 6) in lab axes about their centres (p, 3) [m, lab]."""
    force, moment = wrench[..., :3], wrench[..., 3:]
    moment = moment + np.cross(centre - T_lab_0[:3, 3], force)
    return np.concatenate([force.sum(axis=1) @ T_lab_0[:3, :3], moment.sum(axis=1) @ T_lab_0[:3, :3]], axis=1)


def moved_to(wrench: np.ndarray, old: np.ndarray, new: np.ndarray) -> np.ndarray:
    """A wrench (n, 6) about the point `old`, about the point `new` (3,) [m]."""
    f, m = wrench[:, :3], wrench[:, 3:]
    return np.concatenate([f, m + np.cross(old - new, f)], axis=1)
