"""Horizontal force columns of opposite sign, and where a long log can be divided: both shown by the arm's motion.

    f_x = -m a_x + ...,   f_y = -m a_y + ...        action on the plate, a the acceleration of the hand [m/s2]

A centre of pressure depends on the vertical force alone, so one horizontal column of the other sign passes unseen. It
is drafted as `reversed` where both forces follow the hand and exactly one has the sign a reaction would have.
"""

import numpy as np
import scipy

from calibration.formats.mapping.channels import Markers, Recorded
from calibration.formats.mapping.rests import rests_of_markers
from calibration.formats.survey.bodies import FoundBody
from calibration.formats.survey.view import PlateView

_WINDOW = 0.6  # [s] of the cubic that smooths
_FOLLOWS = 0.7  # [-] correlation of a force with the hand's acceleration
_REST, _PART = 2.4, 10.0  # [s] of a rest that divides a log, and of each part


def reversed_force(plate: PlateView, markers: Markers | None, hand: FoundBody) -> str:
    """The force column whose sign is opposite to the others'; empty where none is, or nothing shows it."""
    if markers is None or len(markers.t) != len(plate.wrench) or not plate.force:
        return ""
    names = [n for n in hand.markers if n in markers.names]
    centre = np.median(markers.position[:, [markers.names.index(n) for n in names]], axis=1)
    t = np.arange(markers.t[0], markers.t[-1], float(np.median(np.diff(markers.t))))
    window = 2 * round(0.5 * _WINDOW / (t[1] - t[0])) + 1
    if len(t) < 4 * window:
        return ""
    both = []
    for k in range(2):
        seen = np.isfinite(centre[:, k])
        x = np.interp(t, markers.t[seen], centre[seen, k])
        f = np.interp(t, markers.t, plate.wrench[:, k])
        a = scipy.signal.savgol_filter(x, window, 3, deriv=2, delta=t[1] - t[0])
        both.append(float(np.corrcoef(a, scipy.signal.savgol_filter(f, window, 3))[0, 1]))
    wanted = -1.0 if plate.convention == "action" else 1.0
    wrong = [k for k in range(2) if both[k] * wanted < 0.0]
    if len(wrong) != 1 or min(map(abs, both)) < _FOLLOWS:
        return ""
    return plate.force[wrong[0]]


def division(recorded: Recorded, hand: FoundBody) -> tuple[float, float] | None:
    """Time [s since the first sample] at which a log can be divided in two, at rest, and its end; None where nowhere.

    Both parts begin with a second of rest and last 10 s or more.
    """
    if recorded.markers is None:
        return None
    t = recorded.markers.t
    found = [r for r in rests_of_markers(recorded, [hand.markers]) - t[0] if r[1] - r[0] >= _REST]
    middles = [0.5 * (start + stop) for start, stop in found]
    length = float(t[-1] - t[0])
    possible = [s for s in middles if _PART <= s <= length - _PART]
    if not possible:
        return None
    return round(float(min(possible, key=lambda s: abs(s - 0.5 * length))), 1), round(length + 0.1, 1)
