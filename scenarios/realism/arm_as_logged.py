"""Swings of the arm that carry the hand where the log's gripper went, and turn it as that turned.

    q(s) = c + A sin(2 pi f s)        arm_1 to arm_7, the lift at rest

The log has three markers on the gripper and no joint angles. From random postures c, A, f, the markers' place on the
gripper and the base's on the plate (1 cm, 30 mrad) were fitted to the paths of all three over two cycles, 0.9 x 0.5 x
0.3 m and 0.8 rad: 2.3 mm rms, f = 0.1972 Hz. Free phases came out 0 or pi: all joints start at their highest speed.
Kept is every fit within 3 mm, inside limits, clear of the body, its markers within 0.2 m of the grasping frame,
as far as the hand reaches; fits that differ only in arm_7's angle, which the markers' place makes up for, are one. All
of them turn arm_1, arm_2 and arm_4 by 0.80, 0.72 and -0.69 rad. Which of them moves a robot is drawn.
"""

from twin.motions import Swing

_FREQUENCY = 0.1972  # [Hz]

# c (8) and A of arm_1 to arm_7 [m, rad]
_FITTED = (
    ((0.33, 1.513, -0.85, -3.205, 1.383, 1.837, -0.865, -1.067), (0.791, 0.714, -0.012, -0.689, -0.031, 0.025, 0.007)),
    ((0.33, 1.513, -0.85, -3.205, 1.383, -1.304, 0.864, -1.925), (0.791, 0.714, -0.012, -0.689, -0.031, -0.025, 0.007)),
    ((0.324, 1.51, -0.849, -3.204, 1.474, -1.209, 0.66, -1.459), (0.792, 0.714, -0.012, -0.689, -0.031, -0.026, 0.007)),
    ((0.312, 1.507, -0.848, -3.204, 1.556, 1.438, -0.427, -1.845), (0.794, 0.715, -0.012, -0.69, -0.063, 0.021, 0.041)),
    ((0.304, 1.505, -0.848, -3.204, 1.602, 1.284, -0.309, -1.399), (0.794, 0.716, -0.012, -0.69, -0.091, 0.018, 0.068)),
    ((0.304, 1.502, -0.848, -3.2, 1.633, -0.75, 0.337, -0.22), (0.796, 0.715, -0.013, -0.689, -0.001, -0.028, -0.023)),
    (
        (0.311, 1.498, -0.848, -3.197, 1.649, -0.401, 0.308, -1.264),
        (0.797, 0.715, -0.013, -0.689, 0.031, -0.024, -0.055),
    ),
    ((0.33, 1.397, -0.833, -3.152, 1.643, -0.213, -0.01, 0.667), (0.803, 0.714, 0.0, -0.699, -1.407, 0.012, 1.409)),
    ((0.33, 1.49, -0.847, -3.19, 1.65, 0.496, 0.156, -1.443), (0.798, 0.716, -0.013, -0.691, 0.156, -0.002, -0.176)),
    (
        (0.33, 1.49, -0.846, -3.191, 1.649, -1.977, -0.183, -1.955),
        (0.797, 0.717, -0.013, -0.692, 0.099, -0.015, -0.118),
    ),
    ((0.33, 1.478, -0.848, -3.179, 1.651, 0.442, 0.085, -0.556), (0.8, 0.716, -0.014, -0.69, 0.305, 0.0, -0.319)),
)

AS_LOGGED = tuple(Swing(c, (0.0, *A), (_FREQUENCY,) * 8, (0.0,) * 8) for c, A in _FITTED)
