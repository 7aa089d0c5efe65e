"""How large the readings' random errors are believed to be where a fit must not be relied on.

    s = lambda s_datasheet of all joints,        ln lambda uniform between ln _LEAST and 0
    believed s^2 = s_datasheet^2 sum_l lambda_l^2 p(data | lambda_l) / sum_l p(data | lambda_l)

A datasheet says what play is tolerated, not what there is. p(data | lambda) is the evidence, parameters integrated out
at their tolerances (`evidence`): few postures tell little and leave a third of the datasheet's play (the root mean
square of a log-uniform factor), more of them tell, and data that fit no robot ask for all of it.
"""

import numpy as np

from calibration.evidence import Widths, evidence
from calibration.hand import HandModel
from calibration.hand_fit import Errors, hand_problem
from calibration.parameters import ParameterSet
from calibration.postures import Postures

_LEAST = 1e-2
_POINTS = 21


def believed_play(
    hand: HandModel, parameters: ParameterSet, postures: Postures, theta: np.ndarray, play: np.ndarray
) -> np.ndarray:
    """(k,) [rad, m] from postures, a robot near theta (p,) and the datasheet's `play` (k,)."""
    problem = hand_problem(hand, parameters, postures, Errors(play, _LEAST * play, np.zeros(0)))
    at, f = problem.linearise(theta), problem.widths.prior
    noise, factors = problem.sources(at), np.geomspace(_LEAST, 1.0, _POINTS)
    values = [evidence(at, noise, problem.prior, Widths(np.append(x * play, 1.0), f)).value for x in factors]
    likely = np.exp(np.min(values) - np.array(values))
    return np.asarray(play * np.sqrt(likely @ factors**2 / likely.sum()))
