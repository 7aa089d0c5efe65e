"""The same markers drawn in other axes are the same cluster."""

import numpy as np
import pytest

from calibration.estimate.drawings import redrawn
from calibration.numerics.lie import from_vector, inverse
from calibration.robot.nominal_frames import frame_names

SHIFT = from_vector(np.array([0.01, -0.02, 0.005, 0.02, 0.0, -0.01]))


def drawn_by(description, name, change):
    """The description with the markers (m, 3) of a body changed."""

    def other(body):
        xyz = change(np.array([m.xyz for m in body.markers]))
        markers = tuple(
            m.model_copy(update={"xyz": tuple(map(float, x))}) for m, x in zip(body.markers, xyz, strict=True)
        )
        return body.model_copy(update={"markers": markers})

    bodies = tuple(other(b) if b.name == name else b for b in description.bodies)
    return description.model_copy(update={"bodies": bodies})


def markers(estimate, description, prefix, body):
    """Places of a body's markers on its link by `model_2` (m, 3) [m]."""
    values = {p.name: p.value for p in estimate.model("model_2").parameters}
    T = from_vector(np.array([values[f"{prefix}.{axis}"] for axis in ("x", "y", "z", "rx", "ry", "rz")]))
    return np.array([T[:3, :3] @ m.xyz + T[:3, 3] for m in body(description).markers])


@pytest.mark.parametrize("k", [0, 1])
def test_markers_stay_on_their_link_when_drawn_in_other_axes(estimate, k):
    prefix, body = frame_names()[k], (lambda d: d.base_body, lambda d: d.hand_body)[k]
    own = estimate.laboratory
    other = drawn_by(own, body(own).name, lambda xyz: (inverse(SHIFT)[:3, :3] @ xyz.T).T + inverse(SHIFT)[:3, 3])
    found, said = redrawn(estimate, other)
    np.testing.assert_allclose(markers(found, other, prefix, body), markers(estimate, own, prefix, body), atol=1e-12)
    assert len(said) == 1 and "22.9 mm" in said[0].message
    assert [v.verdict for v in said] == ["warning"]


def test_the_same_drawing_changes_nothing(estimate):
    assert redrawn(estimate, estimate.laboratory) == (estimate, ())


def test_another_cluster_is_named_and_its_frame_kept(estimate):
    own = estimate.laboratory
    found, said = redrawn(estimate, drawn_by(own, own.hand_body.name, lambda xyz: 2.0 * xyz))
    assert found.models == estimate.models
    assert "another cluster" in said[0].message
