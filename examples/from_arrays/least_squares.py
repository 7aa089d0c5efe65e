"""Marker frames and encoder zeros by scipy: `python least_squares.py DATASET OUT.nc`, then `tiago-twin evaluate`."""

import sys

import numpy as np
from scipy.optimize import least_squares

from calibration import load
from calibration.evaluation import write_submission
from calibration.numerics.lie import from_vector, inverse, to_vector


def predict(folder, out):
    """Write predicted hand poses of the validation trials."""
    dataset = load(folder)
    seen, joints = dataset.postures(), dataset.description.joint_names

    def poses(theta, q):  # F_base nominal(q - zeros) F_hand
        return from_vector(theta[:6]) @ dataset.nominal(q - theta[12:]) @ from_vector(theta[6:12])

    def residual(theta):
        error = to_vector(inverse(seen.T_base_hand) @ poses(theta, seen.q))  # [m, rad]
        return np.concatenate([(error / np.repeat([1e-3, 5e-3], 3)).ravel(), theta[:12] / 0.02, theta[12:] / 0.06])

    theta = least_squares(residual, np.zeros(12 + len(joints))).x
    trials = {e.id: dataset.trial(e.id).aligned() for e in dataset.entries("validation")}
    write_submission(out, {k: (trial.t, trial.T_lab_base @ poses(theta, trial.q_motor)) for k, trial in trials.items()})
    return dict(zip(joints, theta[12:], strict=True))


if __name__ == "__main__":
    for joint, zero in predict(sys.argv[1], sys.argv[2]).items():
        print(f"{joint} {1e3 * zero:.2f} mrad")
