"""Random errors the data do not need: their sizes are set to the least there is.

    cost of dropping group g, the others taking over     1/2 x_g^2 / (F^-1)_gg,     x = v - least v

with F the expected curvature of the evidence by the variances v. The cheapest group goes first, for as long as it costs
less than ln(n) / 2; then the evidence itself is asked once. A size that noise made positive weighs data wrongly.
Reference: Schwarz, Annals of Statistics 1978.
"""

from dataclasses import replace

import numpy as np

from calibration.evidence import Noise, Widths, evidence
from calibration.linearised import Linearised, Prior


def without_needless(at: Linearised, noise: Noise, prior: Prior, widths: Widths) -> tuple[Noise, Widths]:
    """Noise whose needless groups are held at their floor, and the widths then; both unchanged where none is."""
    now, low = evidence(at, noise, prior, widths), noise.floor**2
    x, left = widths.noise**2 - low, list(np.flatnonzero(noise.free & (widths.noise > 1.000001 * noise.floor)))
    price, dropped = 0.5 * np.log(len(at.r)), []
    while left:
        inverse = np.linalg.pinv(now.fisher[np.ix_(left, left)], hermitian=True)
        cost = 0.5 * x[left] ** 2 / np.diag(inverse)
        k = int(np.argmin(cost))
        if cost[k] > price:
            break
        x[left] = np.maximum(x[left] - inverse[:, k] / inverse[k, k] * x[left[k]], 0.0)
        dropped.append(left.pop(k))
    v = np.sqrt(low + np.where(np.isin(np.arange(len(x)), left), x, 0.0))
    fewer = replace(widths, noise=np.where(noise.free, v, widths.noise))
    if not dropped or evidence(at, noise, prior, fewer).value > now.value + price * len(dropped):
        return noise, widths
    return replace(noise, free=noise.free & ~np.isin(np.arange(len(x)), dropped)), fewer
