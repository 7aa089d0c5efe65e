"""Elements of the nominal robot."""

import mjcf


def joints(model):
    """Return the moving joints other than the root, in MuJoCo's order."""
    return [model.joint(i) for i in range(model.njnt) if model.joint(i).name != "root"]


def robot_bodies(model):
    """Return the bodies under base_footprint, itself included."""
    root = model.body(mjcf.ROOT).id
    return [model.body(i) for i in range(model.nbody) if model.body_rootid[i] == root]
