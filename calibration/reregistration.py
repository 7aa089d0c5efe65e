"""Marker bodies registered anew in another session; geometry, zeros and joint models stay as they were calibrated.

    minimise over T_base_B, T_tool_H     sum_i |log6(T_measured_i^-1 T_B_H(q_i))|^2 / tolerance^2        12 parameters

Asked of the dwells of the session's registration trials, which are not scored. Rows of the datasheet, `nominal` and
`model_1`, are not registered. Encoders that were homed anew are not asked for: their error is part of the prediction's.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin

from calibration.bodies import poses_of
from calibration.dataset import Dataset
from calibration.errors import NotEnoughData
from calibration.hand import HandModel
from calibration.markers import base_body, hand_body
from calibration.postures import dwell_windows
from calibration.predict import Predictor
from calibration.recording import Trial
from calibration.schema import Description, TrialEntry
from calibration.se3 import inverse, mean

REGISTRATION = "registration"
_DATASHEET = ("nominal", "model_1")
_STEPS = 20
_STILL = 1e-10  # [m, rad]


def registration_trials(dataset: Dataset) -> tuple[TrialEntry, ...]:
    """Static trials of the confirmation session that are there for registering."""
    return tuple(e for e in dataset.entries("confirmation", "static") if e.motion == REGISTRATION)


def reregistered(predict: Predictor, dataset: Dataset) -> Predictor:
    """The same robots with both marker bodies where the confirmation session's registration trials show them.

    Raises:
        NotEnoughData: No dwell shows base and hand, or they turn about one direction only.
    """
    trials = [dataset.read(entry) for entry in registration_trials(dataset)]
    models = dict(predict.models)
    for name in models.keys() - set(_DATASHEET):
        models[name] = fit_frames(models[name], *_postures(predict, name, trials), predict.description)
    return replace(predict, models=models)


def registration_postures(predict: Predictor, name: str, dataset: Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Mean positions (n, n_joints) a row's geometry is asked with, and measured T_B_H (n, 4, 4), a dwell each."""
    return _postures(predict, name, [dataset.read(entry) for entry in registration_trials(dataset)])


def _postures(predict: Predictor, name: str, trials: Sequence[Trial]) -> tuple[np.ndarray, np.ndarray]:
    seen = [_dwells(predict, name, trial) for trial in trials]
    q, T = (np.concatenate(parts) for parts in zip(*seen, strict=True)) if seen else (np.empty(0), np.empty(0))
    return q, T


def _dwells(predict: Predictor, name: str, trial: Trial) -> tuple[np.ndarray, np.ndarray]:
    """Mean positions (n, n_joints) and measured T_B_H (n, 4, 4) of the dwells that show both bodies."""
    base, hand = base_body(predict.description), hand_body(predict.description)
    q = predict.positions(name, "motor", trial)
    T = inverse(poses_of(base, trial).T) @ poses_of(hand, trial).T
    known = np.isfinite(q).all(axis=1) & np.isfinite(T).all(axis=(1, 2))
    inside = [known & (trial.t_mocap >= a) & (trial.t_mocap <= b) for a, b in dwell_windows(trial)]
    seen = [k for k in inside if k.any()]
    if not seen:
        return np.empty((0, q.shape[1])), np.empty((0, 4, 4))
    return np.array([q[k].mean(axis=0) for k in seen]), np.array([mean(T[k]) for k in seen])


def frame_weights(description: Description) -> np.ndarray:
    """(6,) weights of a pose's errors: in tolerances of a marker body [1/m, 1/rad]."""
    tol = description.tolerances
    return 1.0 / np.repeat([tol.body_translation, tol.body_rotation], 3)


def fit_frames(model: HandModel, q: np.ndarray, T_measured: np.ndarray, description: Description) -> HandModel:
    """The model with both marker frames fitted to T_measured (n, 4, 4) at q (n, n_joints).

    Raises:
        NotEnoughData: Fewer than two postures, or they turn the hand about one direction only.
    """
    weight = frame_weights(description)
    if len(q) < 2:
        raise NotEnoughData(f"{len(q)} registration postures of the confirmation session show base and hand; make more")
    for _ in range(_STEPS):
        found = model.poses_and_derivatives(q, n_parameters=12)
        r = np.array([pin.log6(pin.SE3(E)).vector for E in inverse(T_measured) @ found.T])
        J = (weight[:, None] * found.J).reshape(-1, 12)
        if np.linalg.matrix_rank(J, rtol=1e-6) < 12:
            raise NotEnoughData(
                f"the {len(q)} registration postures of the confirmation session turn the hand about one direction only"
            )
        step = np.linalg.lstsq(J, -(weight * r).ravel(), rcond=None)[0]
        model = replace(model, base=model.base + step[:6], hand=model.hand + step[6:])
        if np.abs(step).max() < _STILL:
            break
    return model
