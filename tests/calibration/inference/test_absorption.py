import numpy as np
import pytest

from calibration.inference.absorption import absorption


def test_shares_of_what_is_hidden_seen_and_half_seen():
    """Zeros span x and y; x is hidden, z seen, both half; stiff priors hide nothing."""
    x, y, z = np.eye(3)[:, :, None]
    own = {"zeros": np.hstack([x, y]), "lengths": np.hstack([y])}
    others = {"hidden": x, "seen": z, "half": (x + z) / np.sqrt(2.0), "known": y}
    of = {"zeros": np.array([0, 1]), "lengths": np.array([2])}
    found = absorption(own | others, of, np.array([0.0, 1e9, 0.0]))
    assert found.classes == ("zeros", "lengths", "hidden", "seen", "half", "known")
    assert found.absorbers == ("zeros", "lengths", "all others")
    rows = dict(zip(found.classes, found.share, strict=True))
    assert rows["hidden"] == pytest.approx([1.0, 0.0, 1.0])
    assert rows["seen"] == pytest.approx([0.0, 0.0, 0.0])
    assert rows["half"] == pytest.approx([0.5, 0.0, 0.5])
    assert rows["known"] == pytest.approx([0.0, 1.0, 1.0], abs=1e-6)
    assert rows["zeros"] == pytest.approx([0.0, 0.5, 0.5])
