import numpy as np

from calibration.numerics.signals import CUTOFF
from calibration.recording.trial import REST
from calibration.stages.suspension.base_response import without_reference


def test_errors_without_their_reference_are_white():
    """W (1 + 1 1' / (c m)) W' = 1 of W as it acts on a trial's samples."""
    n, c, m = 40, 100.0, 2.0 * CUTOFF * REST
    W = without_reference(np.eye(n), c)
    np.testing.assert_allclose(W @ (np.eye(n) + np.ones((n, n)) / (c * m)) @ W.T, np.eye(n), atol=1e-12)
    assert np.abs(W - np.eye(n)).max() > 1e-4


def test_of_a_long_trial_little_of_a_shift_is_left():
    shift, c = np.ones((200_000, 3)), 100.0
    assert without_reference(shift, c).max() < 0.1
    assert without_reference(shift[:100], c).min() > 0.95
    assert without_reference(shift[:0], c).shape == (0, 3)
