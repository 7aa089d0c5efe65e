"""Logarithms of rotations against SciPy's."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from calibration.numerics.lie import rotation_vector

AXES = np.random.default_rng(0).normal(size=(200, 3))
AXES /= np.linalg.norm(AXES, axis=1, keepdims=True)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 1e-3, 0.3, 2.0, np.pi - 1e-7, np.pi])
def test_they_are_those_of_scipy(angle):
    R = Rotation.from_rotvec(angle * np.concatenate([AXES, np.eye(3)])).as_matrix()
    np.testing.assert_allclose(rotation_vector(R), Rotation.from_matrix(R).as_rotvec(), rtol=1e-14, atol=1e-15)


def test_rounded_matrices_are_orthogonalised_unseen_ones_unknown_and_mirrors_refused():
    R = Rotation.from_rotvec(AXES).as_matrix().round(6)
    np.testing.assert_array_equal(rotation_vector(R), Rotation.from_matrix(R).as_rotvec())
    R[3, 1, 2] = np.nan
    assert np.flatnonzero(np.isnan(rotation_vector(R)).any(axis=1)).tolist() == [3]
    with pytest.raises(ValueError, match="determinant"):
        rotation_vector(-np.eye(3))
