"""How late an instrument shows a motion, alike in all trials, where no recording can tell it from its clock.

Robot: a link is late behind viscous friction c on a mesh of stiffness k by c / k, and where dry friction f winds the
mesh by f / k over the speed,

    late = c / k + left * wound + u * unseen,     ln(c / k) ~ N(ln 50 us, 0.6^2),   left ~ U(0, 0.2),   u ~ N(1, 1)

c / k of strain-wave gears (0.5 N.m.s/rad on 10 kN.m/rad), a factor of 1.8 either way from cold to worn in; wound is the
mean lateness of the play that the fit of poses found in the loaded joints. Play operators are not quite what a wound
gear does, and what a fit leaves of such a term has the sign of what it took: of dry friction alone a tenth was left.
Friction never makes a link early: play that the fit finds to be early stands for something else, and only widens.
Short motions do not tell play from lag: of a winding by 0.1 mrad, f / k of such gears (0.6 N.m on 9 kN.m/rad to 0.15 on
1), unseen is what the fit of each trial would lay to the clock; it is one robot's, and no number of trials averages it.
Plate: an anti-alias filter's delay is a part of its clock.
"""

from collections.abc import Sequence

import numpy as np

from calibration.clock import TrialLag

_VISCOUS, _COLD = 5e-5, 0.6  # [s] median of c / k; standard deviation of its logarithm
_LEFT = 0.2  # at most, of what dry friction winds
_PLATE = 3e-4  # [s]


def allowance(instrument: str, lags: Sequence[TrialLag]) -> tuple[float, float]:
    """Mean and standard deviation [s] of what all trials share."""
    if instrument == "plate":
        return 0.0, _PLATE
    if not lags:
        return 0.0, 0.0
    w = np.array([t.lag.sigma for t in lags]) ** -2.0
    wound, unseen = w @ [(t.wound, t.unseen) for t in lags] / w.sum()
    viscous = _VISCOUS * np.exp(0.5 * _COLD**2)
    spread = viscous * np.sqrt(np.expm1(_COLD**2))
    sigma = np.linalg.norm([spread, _LEFT / np.sqrt(12.0) * wound, unseen])
    return float(viscous + 0.5 * _LEFT * max(wound, 0.0) + unseen), float(sigma)
