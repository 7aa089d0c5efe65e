"""Positions of markers that are none: a reflection or another marker, for a moment, while the body keeps its shape.

    m_i = rms_k |p_ik - T_i (x_k + e_k)|          x_k drawn, e_k the median of what the samples show against it   [m]

Where m_i is five times its median, the body has a marker that is not where it is seen. That one is masked without which
the others are rigid again; the whole body where none of them is. Where it is not rigid for most of a second there is no
ghost but a marker that was moved, which `checks.marker_shapes` names. A mean over a dwell would follow ghosts: 1 % of
50 mm are 0.5 mm.
"""

import numpy as np

from calibration.mocap.cluster_pose import misfit, shown_shape

_ODD, _RIGID = 5.0, 3.0  # times the median
_LASTS, _SHARE = 0.5, 0.45  # [s] around a ghost; of samples that may be odd there


def without_ghosts(xyz: np.ndarray, t: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Markers (n, m, 3) [m, lab] of a body drawn as xyz (m, 3), at t (n,) [s], ghosts masked; p itself without one."""
    xyz = shown_shape(xyz, p)
    found = misfit(xyz, p)
    seen = np.isfinite(p).all(axis=2)
    shown = seen.sum(axis=1) >= 3
    if not shown.any() or (usual := float(np.median(found[shown]))) == 0.0:
        return p
    odd, not_rigid = (np.flatnonzero(found > times * usual) for times in (_ODD, _RIGID))
    rows = _passing(odd, not_rigid, np.flatnonzero(shown), t)
    if not len(rows):
        return p
    rest = np.repeat(p[rows][None], len(xyz), axis=0)
    for k in range(len(xyz)):
        rest[k, :, k] = np.nan
    left = np.array([misfit(xyz, q) for q in rest])
    left[np.isfinite(rest).all(axis=3).sum(axis=2) < 3] = np.inf
    best = np.argmin(left, axis=0)
    out = p.copy()
    out[rows] = np.where((left.min(axis=0) < _RIGID * usual)[:, None, None], rest[best, np.arange(len(rows))], np.nan)
    return out


def _passing(odd: np.ndarray, not_rigid: np.ndarray, shown: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Of `odd` samples at t (n,) [s] those around which most of those `shown` are rigid."""
    near = t[odd] + [[-_LASTS], [_LASTS]]
    wrong, every = (np.diff(np.searchsorted(t[x], near), axis=0)[0] for x in (not_rigid, shown))
    return np.asarray(odd[wrong < _SHARE * every])
