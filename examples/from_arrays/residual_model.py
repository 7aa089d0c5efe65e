"""A residual learnt by scikit-learn: `python residual_model.py DATASET OUT.nc`, then `tiago-twin evaluate`.

Twist of the hand between the nominal robot and the measurement, as a ridge regression of sin q, cos q.
"""

import sys

import numpy as np
from sklearn.linear_model import RidgeCV

from calibration import load
from calibration.evaluation import write_submission
from calibration.numerics.lie import from_vector, inverse, to_vector


def predict(folder, out):
    """Write predicted hand poses of the validation trials."""
    dataset = load(folder)
    seen = dataset.postures()
    twist = to_vector(inverse(dataset.nominal(seen.q)) @ seen.T_base_hand)
    model = RidgeCV(np.logspace(-3, 2, 11)).fit(features(seen.q), twist)
    found = {}
    for entry in dataset.entries("validation"):
        trial = dataset.trial(entry.id).aligned()
        known = np.isfinite(trial.q_motor).all(axis=1)
        T = np.full_like(trial.T_lab_hand, np.nan)
        F = from_vector(model.predict(features(trial.q_motor[known])))
        T[known] = trial.T_lab_base[known] @ dataset.nominal(trial.q_motor[known]) @ F
        found[entry.id] = trial.t, T
    write_submission(out, found)


def features(q):
    """Sines and cosines of the readings (n, 2 n_joints)."""
    return np.hstack([np.sin(q), np.cos(q)])


if __name__ == "__main__":
    predict(sys.argv[1], sys.argv[2])
