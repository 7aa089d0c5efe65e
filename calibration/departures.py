"""What a robot does that its calibration does not ask for, as nuisances z ~ N(0, I) with widths a datasheet gives.

    placement of joint j    turned by  b_j M_j z        bending under the moment M_j across its axis

It is a function of the posture, not noise: the fit takes it for geometry, and a design that knows only noise goes
where it is largest. M is the gravity moment in the joint's frame [N.m]. Play that gravity holds is asked for (`gears`).
"""

from dataclasses import dataclass

import numpy as np

from calibration.hand import HandModel, HandPoses
from calibration.loads import gravity_moments
from calibration.robot import Chain

_BENDING = 3e-3  # of a joint's place at the largest moment it carries, a tenth of what gears give [rad]
_LEAST = 0.5  # [N.m] a joint that gravity loads less is not asked


@dataclass(frozen=True)
class Departures:
    """Widths of the nuisances.

    Attributes:
        bending: (k,) b of each joint's placement [rad/(N.m)].
    """

    bending: np.ndarray

    def effects(self, model: HandModel, q: np.ndarray, found: HandPoses) -> np.ndarray:
        """Local twists of the hand (n, 6, k) at readings q (n, n_measured), for each z = 1; `found` at q."""
        chain, (n, k) = model.chain, (len(q), len(self.bending))
        turns = found.J[:, :, 12 : 12 + 6 * k].reshape(n, 6, k, 6)[:, :, :, 3:]
        return np.asarray(np.einsum("ndkj,nkj->ndk", turns, self.bending[:, None] * moments(chain, q)))


def departures_of(chain: Chain, q: np.ndarray) -> Departures:
    """Those of a robot whose moments are as at postures q (n, n_measured)."""
    largest = np.linalg.norm(moments(chain, q), axis=2).max(axis=0)
    return Departures(np.where(largest > _LEAST, _BENDING / np.maximum(largest, _LEAST), 0.0))


def moments(chain: Chain, q: np.ndarray) -> np.ndarray:
    """Gravity moments (n, k, 3) across each joint's axis, in its own frame [N.m], at q (n, n_measured)."""
    return gravity_moments(chain.drawn, chain.loads, q[:, chain.columns])
