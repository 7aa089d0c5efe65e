"""How a motion ties the rests of a trial together.

From one rest to the next, on the floor:

spin     (dx, dy) = w                          w ~ N(0, s^2 1)     a free centre that wanders by s a step
drive    dy cos(phi) - dx sin(phi) = w         w ~ N(0, s^2)       no side slip; phi the mean heading, exact on arcs
"""

from dataclasses import dataclass

import numpy as np

from calibration.base_motion import Stations


@dataclass(frozen=True)
class Ties:
    """Linearised constraints between rests: c(d + dd) = c + C dd.

    Attributes:
        c: (m,) value [m].
        C: (m, n, 3) derivative by every rest's planar pose.
        trial: (m,) index of the trial each row is of.
    """

    c: np.ndarray
    C: np.ndarray
    trial: np.ndarray


def ties(stations: Stations, planar: np.ndarray) -> Ties:
    """Constraints between consecutive rests of each trial, see the head of this file."""
    n, values, rows, trials = len(planar), [], [], []
    for i in range(1, n):
        trial = stations.trial[i]
        if stations.trial[i - 1] != trial:
            continue
        dx, dy = planar[i, :2] - planar[i - 1, :2]
        if stations.kinds[trial] == "spin":
            row = np.zeros((2, n, 3))
            row[:, i, :2], row[:, i - 1, :2] = np.eye(2), -np.eye(2)
            values += [dx, dy]
        else:
            phi = 0.5 * (planar[i, 2] + planar[i - 1, 2])
            s, k = np.sin(phi), np.cos(phi)
            turning = -0.5 * (dx * k + dy * s)
            row = np.zeros((1, n, 3))
            row[0, i], row[0, i - 1] = (-s, k, turning), (s, -k, turning)
            values.append(dy * k - dx * s)
        rows.append(row)
        trials += [trial] * len(row)
    return Ties(np.array(values), np.concatenate(rows), np.array(trials))
