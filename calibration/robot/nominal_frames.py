"""Where the arm begins: the base frame of Heins's arm in a chain of joints.

    T_base_tool(q) = T_base_arm(q_before)  T_arm_tool(q)

`arm` is the frame of the arm's first joint at its zero, all before it at theirs. Prismatic joints at the start of the
chain are a lift or a rail of the base. An increment on the right, T_base_arm exp6(xi), is a placement of that joint.
"""

import numpy as np

from calibration.errors import InputError
from calibration.numerics.lie import from_vector, inverse, jlog6, local_twist, log6, to_vector
from calibration.recording.schema import Body, Description
from calibration.robot.chain import Chain

PREFIX = "frame.base.arm"
AXES = ("x", "y", "z", "rx", "ry", "rz")
METRES_PER_RAD = 0.1  # a prismatic joint's tolerances are an angle's times this


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


def frame_names() -> tuple[str, str]:
    """Prefixes of the two registrations: base body in the base frame, hand body in the tool frame."""
    return "frame.base.base", "frame.tool.hand"


def nominal_frames(chain: Chain, description: Description) -> np.ndarray:
    """T_base_B and T_tool_H with every marker body on its link as nominal, (12,) [m, rad]."""
    T_base_tool = chain.poses(np.zeros((1, len(chain.measured))))[0]
    T_tool_H = np.linalg.solve(T_base_tool, _drawn(chain, description.hand_body))
    return np.concatenate([to_vector(nominal_base_body(chain, description)), to_vector(T_tool_H)])


def nominal_base_body(chain: Chain, description: Description) -> np.ndarray:
    """T_base_B (4, 4) with the base's marker body as nominal; the hand may have none."""
    return _drawn(chain, description.base_body)


def _drawn(chain: Chain, body: Body) -> np.ndarray:
    """Pose (4, 4) of a marker body in the base, all joints at zero."""
    T_base_link = chain.poses(np.zeros((1, len(chain.measured))), body.link)[0]
    return np.asarray(T_base_link @ from_vector(np.array(body.placement)))
