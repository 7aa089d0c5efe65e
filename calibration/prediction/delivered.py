"""What the prediction of one trial by the delivered row is made of, for its error to be taken apart.

T_lab_H = T_lab_B T_B_H(q)            dp_lab = J dq
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Delivered:
    """Parts of n predicted poses, k joints of the chain.

    Attributes:
        joints: Their names.
        T_lab_B: (n, 4, 4) the base's marker body.
        T_B_H: (n, 4, 4) the hand in it.
        q: (n, k) joint positions the geometry is evaluated at [rad, m].
        q_link: (n, k) link encoders; NaN where there is none.
        J: (n, 3, k) displacement of the hand by q [m/rad, lab axes].
        without: T_lab_H (n, 4, 4) with one effect switched off, by its name.
    """

    joints: tuple[str, ...]
    T_lab_B: np.ndarray
    T_B_H: np.ndarray
    q: np.ndarray
    q_link: np.ndarray
    J: np.ndarray
    without: tuple[tuple[str, np.ndarray], ...]
