"""Where the arm begins: the base frame of Heins's arm in a chain of joints.

    T_base_tool(q) = T_base_arm(q_before)  T_arm_tool(q)

`arm` is the frame of the arm's first joint at its zero, all before it at theirs. Prismatic joints at the start of the
chain are a lift or a rail of the base. An increment on the right, T_base_arm exp6(xi), is a placement of that joint.
"""

import numpy as np

from calibration.errors import InputError
from calibration.robot import Chain
from calibration.se3 import from_vector, inverse, local_twist
from calibration.twists import jlog6, log6

PREFIX = "frame.base.arm"


def first_joint(chain: Chain) -> str:
    """First joint of the arm: the first one that is not prismatic.

    Raises:
        InputError: There is none.
    """
    found = next((name for name in chain.joints if not chain.is_prismatic(name)), None)
    if found is None:
        raise InputError("dataset.json", f"no arm: every joint of {chain.joints} is prismatic")
    return found


def arm_poses(chain: Chain, q: np.ndarray) -> np.ndarray:
    """T_base_arm (n, 4, 4) of the chain at readings q (n, n_measured), the arm's own joints at zero."""
    first = first_joint(chain)
    before = chain.joints[: chain.joints.index(first)]
    still = np.zeros_like(q)
    columns = [chain.measured.index(name) for name in before]
    still[:, columns] = q[:, columns]
    return chain.poses(still, first)


def nominal_arm(chain: Chain) -> np.ndarray:
    """T_base_arm (4, 4) of the chain with every joint at zero."""
    return arm_poses(chain, np.zeros((1, len(chain.measured))))[0]


def as_placements(chain: Chain, T_base_arm: np.ndarray) -> np.ndarray:
    """Placement twists (k, 6) of a nominal chain [m, rad] that put its arm at T_base_arm (4, 4)."""
    xi = np.zeros((len(chain.joints), 6))
    xi[chain.joints.index(first_joint(chain))] = log6(inverse(nominal_arm(chain)) @ T_base_arm)
    return xi


def placement_derivative(chain: Chain, vector: np.ndarray) -> np.ndarray:
    """Derivative (6, 6) of that joint's twist by translation and rotation vector (6,) of T_base_arm."""
    return jlog6(log6(inverse(nominal_arm(chain)) @ from_vector(vector))) @ local_twist(vector)
