"""Nearest rotations against the singular value decomposition."""

import numpy as np
import pytest

from calibration.numerics.alignment import nearest_rotations

SIZES = {"round": [1.0, 0.8, 0.5], "thin": [1.0, 1e-2, 1e-3], "flat": [1.0, 0.5, 0.0], "far": [1e9, 1e8, 1e7]}


def decomposed(B):
    """By singular values: the textbook formula, one matrix at a time."""
    out = []
    for b in B:
        U, _, Vt = np.linalg.svd(b)
        out.append(U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt)
    return np.array(out)


@pytest.mark.parametrize("sizes", SIZES.values(), ids=SIZES.keys())
def test_they_are_those_of_the_singular_values_mirrored_matrices_included(sizes):
    rng = np.random.default_rng(0)
    B = rng.normal(size=(500, 3, 3)) @ np.diag(sizes) @ rng.normal(size=(3, 3))
    assert sizes[2] == 0.0 or 0.2 < (np.linalg.det(B) < 0.0).mean() < 0.8
    found, expected = nearest_rotations(B), decomposed(B)
    np.testing.assert_allclose(found @ np.swapaxes(found, 1, 2), np.broadcast_to(np.eye(3), B.shape), atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(found), 1.0, atol=1e-14)
    gain, best = (np.einsum("nij,nij->n", R, B) for R in (found, expected))
    np.testing.assert_allclose(gain, best, rtol=1e-14)
    # How far rounding turns it hangs on the second and the signed third singular value.
    s = np.linalg.svd(B, compute_uv=False)
    weak = (s[:, 1] + np.sign(np.linalg.det(B)) * s[:, 2]) / s[:, 0]
    assert (np.abs(found - expected).max(axis=(1, 2)) * weak).max() < 1e-14


def test_where_many_are_as_near_one_of_them_is_given():
    line = np.outer([1.0, 2.0, 3.0], [0.3, -0.2, 0.1])
    for B in (np.zeros((3, 3)), line, -np.eye(3)):
        R = nearest_rotations(B[None])[0]
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-14)
        assert np.linalg.det(R) == pytest.approx(1.0)
        assert np.trace(R.T @ B) == pytest.approx(np.trace(decomposed(B[None])[0].T @ B))
    assert nearest_rotations(np.zeros((0, 3, 3))).shape == (0, 3, 3)
