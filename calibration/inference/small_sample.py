"""Covariance of a fit whose random errors have sizes that are estimated from the same data.

    C = Phi + 2 Phi L Phi,     L = sum_gh W_gh (Q_gh - P_g Phi P_h)
    P_g = -J' A_g J,   Q_gh = J' A_g A_h J,   A_g = K_g K_g',   K_g = sources of group g                  whitened
    (W^-1)_gh = 1/2 tr(A_g A_h) - tr(Phi Q_gh) + 1/2 tr(Phi P_g Phi P_h)        information of the variances (g, g)

Phi = (J'J + P)^-1 takes the variances v_g for known. One half of the term is what their errors add to those of the
parameters, the other what Phi is too small by, being that of variances which fit these data best. It is much where
postures are few.
Reference: Kenward, Roger, Biometrics 1997, eqs. 3 to 5 with V linear in the variances.
"""

import numpy as np

from calibration.inference.map_estimate import Fit


def small_sample_covariance(fit: Fit) -> np.ndarray:
    """C (p, p) of a fit's parameters; Phi where no size was estimated."""
    free, Phi, group = np.flatnonzero(fit.noise.free), fit.covariance, fit.noise.group
    if not len(free):
        return Phi
    J, K = fit.whitener @ fit.at.J, fit.noise.roots(fit.at.B, fit.widths.noise) @ fit.at.B
    n, d, p = J.shape
    A = [K[:, :, group == g] @ np.swapaxes(K[:, :, group == g], 1, 2) for g in free]
    moved = np.array([(a @ J).reshape(n * d, p) for a in A])
    P, Q = -J.reshape(n * d, p).T @ moved, np.swapaxes(moved, 1, 2)[:, None] @ moved
    seen = Phi @ P
    own = np.array([[(a * b).sum() for b in A] for a in A])
    taken = (Phi * Q).sum(axis=(2, 3)) - 0.5 * np.tensordot(seen, seen, axes=((1, 2), (2, 1)))
    W = np.linalg.pinv(0.5 * own - taken, hermitian=True)
    L = np.tensordot(W, Q, axes=2) - (P @ np.tensordot(W, seen, axes=1)).sum(axis=0)
    size, V = np.linalg.eigh(L + L.T)
    more = (Phi @ V) * np.sqrt(np.maximum(size, 0.0))  # rounding apart none is negative
    return np.asarray(Phi + more @ more.T)
