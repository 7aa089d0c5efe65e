"""Nominal robot and one constant transform: `python constant_offset.py DATASET OUT.nc`, then `tiago-twin evaluate`."""

import sys

import numpy as np

from calibration import load
from calibration.evaluation import write_submission
from calibration.numerics.lie import inverse, mean


def predict(folder, out):
    """Write predicted hand poses of the validation trials."""
    dataset = load(folder)
    seen = dataset.postures()
    F = mean(inverse(dataset.nominal(seen.q)) @ seen.T_base_hand)  # T_base_hand = nominal(q) F
    found = {}
    for entry in dataset.entries("validation"):
        trial = dataset.trial(entry.id).aligned()
        found[entry.id] = trial.t, trial.T_lab_base @ dataset.nominal(trial.q_motor) @ F
    write_submission(out, found)
    return np.linalg.norm((dataset.nominal(seen.q) @ F - seen.T_base_hand)[:, :3, 3], axis=1)


if __name__ == "__main__":
    error = predict(sys.argv[1], sys.argv[2])
    print(f"{len(error)} postures, rms {1e3 * np.sqrt((error**2).mean()):.2f} mm")
