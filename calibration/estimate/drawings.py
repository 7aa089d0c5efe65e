"""An estimate's marker bodies in the drawings of another dataset.json.

The same markers with other coordinates in their body's frame are the same cluster, its frame elsewhere in it:

    x_old = X x_new                  X = argmin sum_m |x_old,m - X x_new,m|^2
    T_link_new = T_link_old X        of the base's body and of the hand's, T_link_old as estimated
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from calibration.estimate.estimate import Estimate
from calibration.inference.parameters import Model
from calibration.mocap.cluster_pose import body_poses
from calibration.numerics.lie import from_vector, to_vector
from calibration.recording.schema import Body, Description
from calibration.robot.nominal_frames import AXES, frame_names
from calibration.verdict import Verdict

_SAME = 1e-9  # [m, rad]
_TRIANGLE = 3  # markers that determine a frame


def redrawn(estimate: Estimate, description: Description) -> tuple[Estimate, tuple[Verdict, ...]]:
    """The estimate with its marker frames where `description` draws them, and a warning of each that moved.

    Itself where the drawings agree, where fewer than three markers are common to both, or where the markers are too far
    apart from those of the estimate to be the same cluster.
    """
    own = estimate.laboratory
    if own is None or description.hand_body.is_point or own.hand_body.is_point:
        return estimate, ()
    bodies = (own.base_body, own.hand_body), (description.base_body, description.hand_body)
    moved, found = {}, []
    for prefix, old, new in zip(frame_names(), *bodies, strict=True):
        X, misfit = _between(old, new)
        size = to_vector(X)
        if np.abs(size).max() <= _SAME and misfit <= _SAME:
            continue
        message = f"body {new.name} has other marker coordinates than in the calibration's dataset.json"
        if misfit > description.tolerances.body_translation:
            message = f"{message}, its markers by {1e3 * misfit:.1f} mm rms: another cluster? calibrate with this one"
        else:
            moved[prefix] = X
            far, turned = 1e3 * np.linalg.norm(size[:3]), np.degrees(np.linalg.norm(size[3:]))
            message = f"{message}, by {far:.1f} mm and {turned:.2f} deg; its frame is taken from this drawing"
        found.append(Verdict("evaluation", "warning", message))
    models = tuple(_redrawn(model, moved) for model in estimate.models) if moved else estimate.models
    return replace(estimate, models=models), tuple(found)


def _between(old: Body, new: Body) -> tuple[np.ndarray, float]:
    """X (4, 4) from the drawing `new` to `old`, and the rms distance of markers after it [m]."""
    known = {m.name: m.xyz for m in old.markers}
    common = [m for m in new.markers if m.name in known]
    if len(common) < _TRIANGLE:
        return np.eye(4), 0.0
    found = body_poses(np.array([m.xyz for m in common]), np.array([[known[m.name] for m in common]]))
    return found.T[0], float(np.sqrt((found.residual**2).sum(axis=2).mean()))


def _redrawn(model: Model, moved: Mapping[str, np.ndarray]) -> Model:
    values = {p.name: p.value for p in model.parameters}
    for prefix, X in moved.items():
        names = [f"{prefix}.{axis}" for axis in AXES]
        if all(name in values for name in names):
            frame = to_vector(from_vector(np.array([values[name] for name in names])) @ X)
            values |= dict(zip(names, map(float, frame), strict=True))
    return replace(model, parameters=tuple(replace(p, value=values[p.name]) for p in model.parameters))
