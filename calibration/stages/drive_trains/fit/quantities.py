"""What is reported of a drive train: values in the contract's names, standard deviations, and what was not excited.

A parameter is estimated where the trials narrow it: its standard deviation is below half of its prior's, or a third of
its value. The others are what friction, load and motion of the trials do not show, each with the motion that would.
Covariance by blocks of time; a direction no block identifies has that of the prior. Two errors no block shows:

- readings show the link encoder's eccentricity less the motor encoder's, which the prior of that bounds;
- a mesh that friction holds is not quite the model's: FORM is the rms error of its parameters on robots of development.
"""

from dataclasses import replace

import numpy as np

from calibration.errors import NotEnoughData
from calibration.numerics.robust_covariance import block_covariance
from calibration.stages.drive_trains.drive_train import HARMONICS, DriveTrain, Quantity, Status
from calibration.stages.drive_trains.fit.train_fit import GAMMA_INFORMATION, TrainFit, derivatives, weights

_NARROWED, _SHARE = 0.5, 0.33
_RARER = 0.01  # share of the samples, at least, in which a mesh may lie on its rarer side
_SEEN = 1e-6  # share of the prior's standard deviation: less, and no block speaks for a parameter
MOTOR = np.array([3e-4, 3e-4, 1e-4, 1e-4])  # [rad] prior of a motor encoder's eccentricity, seen at the joint
FORM = {"half_gap": 0.16, "compliance": 0.21, "coulomb": 0.27, "viscous": 0.45, "spring": 0.2, "slip": 0.16}  # shares
_REMEDIES = {
    "half_gap": "move {0} back and forth in postures where its load changes sign",
    "compliance": "hold {0} in postures of different load, or with a payload and without",
    "coulomb": "reverse {0} slowly in several postures",
    "viscous": "sweep {0} slowly and fast over the same angles",
    "spring": "reverse {0} by steps as small as its backlash",
    "slip": "reverse {0} by steps as small as its backlash",
    "link": "sweep {0} through as much of a turn as it has",
    "motor": "swing {0} through as much of a turn as it has in sight of the hand's markers",
}


def covariance_of(fit: TrainFit) -> np.ndarray:
    """(p + 5, p + 5) of theta and gamma, by blocks of time; 1.96 standard deviations hold 95 %."""
    problem, data, r = fit.problem, fit.problem.data, fit.residuals
    A = derivatives(problem, fit.theta, fit.gamma)
    w = np.sqrt(weights(problem, r, fit.scales))
    J, e = w[:, None] * A, w * np.where(np.isfinite(r), r, 0.0)
    known = [np.flatnonzero((data.trial == i) & np.isfinite(r)) for i in range(len(data.trial_ids))]
    known = [rows for rows in known if len(rows)]
    information = np.diag(problem.prior.information)
    H = J.T @ J / problem.correlated + problem.prior.information
    floor = np.linalg.inv(H)
    try:
        found = block_covariance(
            [J[k][:, None] for k in known], [e[k][:, None] for k in known], problem.correlated * information
        )
    except NotEnoughData:
        return np.asarray(floor)
    sigma, least = (np.sqrt(np.maximum(np.diag(C), np.finfo(float).tiny)) for C in (found.covariance, floor))
    most = np.maximum(1.0 / np.sqrt(np.maximum(information, np.finfo(float).tiny)), least)
    wanted, seen = np.clip(sigma, least, most), sigma > _SEEN * least
    factor = np.where(seen, wanted / sigma, 0.0)
    return np.asarray(np.outer(factor, factor) * found.covariance + np.diag(np.where(seen, 0.0, wanted**2)))


def reported(train: DriveTrain, fit: TrainFit, covariance: np.ndarray, motor_offset: float) -> DriveTrain:
    """The drive train with its parameters; `motor_offset` [rad] is the zero of its motor readings."""
    sigma, names, n = np.sqrt(np.diag(covariance)), fit.problem.names, len(fit.theta)
    gap = names.index("half_gap")
    sigma[gap] = np.hypot(sigma[gap], fit.theta[names.index("compliance")] * train.torque_sigma)
    own = {
        "half_gap": ("backlash.{}.gap", "rad", 2.0),
        "compliance": ("gear.{}.compliance", "rad/(N.m)", 1.0),
        "coulomb": ("friction.{}.coulomb", "N.m", 1.0),
        "viscous": ("friction.{}.viscous", "N.m.s/rad", 1.0),
        "spring": ("hysteresis.{}.stiffness", "N.m/rad", 1.0),
        "slip": ("hysteresis.{}.slip", "N.m", 1.0),
    }
    found = []
    for what, (name, unit, factor) in own.items():
        if what not in names:
            continue
        i = names.index(what)
        if fit.problem.form == "friction_held":
            sigma[i] = np.hypot(sigma[i], FORM[what] * fit.theta[i])
        status = _status(float(fit.theta[i]), float(sigma[i]), float(fit.problem.prior.width[i]))
        if what == "half_gap" and not reverses(
            fit.problem.data.motion.torque, float(fit.theta[names.index("coulomb")])
        ):
            status, sigma[i] = "not_identifiable", fit.problem.prior.width[i]
        found.append(_quantity(train.joint, name, unit, factor * fit.theta[i], factor * sigma[i], status, what))
    if np.isfinite(train.link).all():
        name = f"encoder.{train.joint}.link.offset"
        found.append(Quantity(name, "rad", motor_offset - float(fit.gamma[0]), float(sigma[n]), "estimated"))
        widths = 1.0 / np.sqrt(GAMMA_INFORMATION[1:])
        sigma[n + 1 :] = np.hypot(sigma[n + 1 :], MOTOR)
        for k, what in enumerate(HARMONICS):
            status = _status(0.0, float(sigma[n + 1 + k]), float(widths[k]))
            name = "encoder.{}.link." + what
            found.append(_quantity(train.joint, name, "rad", train.link[1 + k], sigma[n + 1 + k], status, "link"))
    for k, what in enumerate(HARMONICS):
        name = "encoder.{}.motor." + what
        found.append(
            _quantity(train.joint, name, "rad", train.motor[k], MOTOR[k], "not_identifiable", "motor")
        )  # fmt: skip
    return replace(train, parameters=tuple(found))


def reverses(torque: np.ndarray, coulomb: float) -> bool:
    """Whether torques (n,) [N.m] with dry friction press the mesh against both its sides: only then is a gap seen.

    A load beyond friction in all but a hundredth of the samples, always of one sign, keeps the mesh on one side.
    """
    shares = np.mean(torque > coulomb), np.mean(torque < -coulomb)
    return bool(max(shares) < 1.0 - _RARER)


def _status(value: float, sigma: float, width: float) -> Status:
    return "estimated" if sigma < _NARROWED * width or sigma < _SHARE * abs(value) else "not_identifiable"


def _quantity(joint: str, name: str, unit: str, value: float, sigma: float, status: Status, what: str) -> Quantity:
    remedy = "" if status == "estimated" else _REMEDIES[what].format(joint)
    return Quantity(name.format(joint), unit, float(value), float(sigma), status, remedy)
