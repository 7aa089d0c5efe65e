"""What the base did on its wheels in one trial, and the wrench that made it.

    (K + G) x + C dx/dt + M d2x/dt2 = w

x displacement of the base frame, w change of the wrench since the first second, both in frame 0, low-passed alike.
With the plate's wrench M = 0: it is what the floor feels. Inverse dynamics holds the base still, so the base's
inertia M and the shift of its weight are on the left. G is no spring's: forces that are there at rest, f_i at p_i, turn
with the base (wheels are suspended in its axes), and its weight f moves with its centre of mass c,

    G x = sum_i [theta x f_i ; p_i x (theta x f_i)] - [0 ; (t + theta x c) x f]            second term: dynamics only

The first is 745 N/rad between force and tilt on TIAGo, the second takes W c_z = 270 N.m/rad off roll and pitch.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from calibration.bodies import poses_of
from calibration.errors import NotEnoughData
from calibration.markers import base_body
from calibration.recording import Trial
from calibration.schema import Description
from calibration.se3 import skew
from calibration.signals import RATE, even, low_passed
from calibration.suspension_rest import REST, Rest
from calibration.suspension_wrench import CUTOFF, Load

_INDEPENDENT = 2.0 * CUTOFF * REST  # samples of low-passed noise in the first second
_RESTLESS = (_INDEPENDENT + 1.0) / (_INDEPENDENT - 1.0)  # of x minus its mean over that second, over variance in it


@dataclass(frozen=True)
class Forcing:
    """What drives the base in one trial.

    Attributes:
        t: (n,) [s, mocap clock], spacing 1 / RATE.
        w: (n, 6) change of the wrench since the first second [N, N.m, frame 0].
        rest: (6,) wrench in the first second.
        inertia: M (6, 6).
        tangent: G (6, 6).
        T_0_plate: (4, 4) centre of the first plate and axes of its readings; frame 0 for dynamics.
    """

    t: np.ndarray
    w: np.ndarray
    rest: np.ndarray
    inertia: np.ndarray
    tangent: np.ndarray
    T_0_plate: np.ndarray


@dataclass(frozen=True)
class Sway:
    """Forcing and displacement of one trial.

    Attributes:
        trial_id: The trial.
        forcing: On the same grid.
        x: (n, 6) displacement [m, rad, frame 0].
        valid: (n,) False inside holes of the recording.
        noise: (6,) mean square that the noise of motion capture adds to x, its reference included.
    """

    trial_id: str
    forcing: Forcing
    x: np.ndarray
    valid: np.ndarray
    noise: np.ndarray


def forcing_of(load: Load, start: float) -> Forcing:
    """Change of a load since the first second of the trial, which began at `start` [s, mocap clock].

    Raises:
        NotEnoughData: The load was not recorded then.
    """
    t, w = load.signal.t, load.signal.x
    early = t <= start + REST
    if early.sum() < 0.5 * REST * RATE:
        raise NotEnoughData(f"the wrench of the first second is missing: it begins {t[0] - start:.2f} s into the trial")
    rest = w[early].mean(axis=0)
    return Forcing(t, w - rest, rest, load.inertia, _tangent(rest, load), load.T_0_plate)


def sway_of(description: Description, trial: Trial, rest: Rest, load: Load, cutoff: float = CUTOFF) -> Sway:
    """Displacement by the base markers, and the forcing on its grid.

    Raises:
        NotEnoughData: Markers or wrench are missing.
    """
    forcing = forcing_of(load, float(trial.t_mocap[0]))
    found = low_passed(even(trial.t_mocap, rest.displacement(poses_of(base_body(description), trial).T)), cutoff)
    keep = (found.t >= forcing.t[0]) & (found.t <= forcing.t[-1])
    if keep.sum() < 2.0 * RATE:
        raise NotEnoughData(f"{trial.id}: base markers and wrench overlap for less than two seconds")
    t, x = found.t[keep], found.x[keep]
    early = t <= trial.t_mocap[0] + REST
    w = CubicSpline(forcing.t, forcing.w)(t)
    on_grid = replace(forcing, t=t, w=w)
    return Sway(trial.id, on_grid, x - x[early].mean(axis=0), found.valid[keep], x[early].var(axis=0) * _RESTLESS)


def _tangent(rest: np.ndarray, load: Load) -> np.ndarray:
    """G (6, 6) from the wrench at rest: its weight W and centre of pressure, moments (-W y, W x)."""
    G = np.zeros((6, 6))
    G[:3, 3:] = -skew(rest[:3] * [0.0, 0.0, 1.0])
    G[5, 3:5] = rest[4], -rest[3]
    if load.weight > 0.0:
        f = np.array([0.0, 0.0, -load.weight])
        G[3:, :3] += skew(f)
        G[3:, 3:] -= skew(f) @ skew(load.centre_of_mass)
    return G
