"""What a fit says of the wheels, in the contract's names.

    suspension.<wheel>.{kx,ky} [N/m], .{cx,cy} [N.s/m]     contact.<wheel>.mu [-]
    slip.body_c [N.s/m], slip.body_cr [N.m.s/rad], slip.{drive_load,back_load} [-]

Wheels of one type share a value. Logarithms are normal: sigma = value * sigma_log, to first order. What the model
leaves out of a real wheel is not in the data's scatter: MODEL is added to each logarithm, the root mean square by which
37 simulated robots, 22 of them with sampled wheels or loads, differ from what the fit finds; casters' dampers seem 30 %
stronger than they are.

A value is `estimated` where its logarithm is known to 0.3 and twice as well as before, and wheels are what moves the
base; a friction that no trial reaches is not. Casters' damping is not either: what moves the base in its peaks is not
known well enough to show it.
"""

from collections.abc import Iterator

import numpy as np

from calibration.inference.parameters import Parameter, Status
from calibration.stages.stick_slip.model import Direction
from calibration.stages.stick_slip.wheels import DRIVES, NAMES, PRIOR, PRIOR_SIGMA, WheelSet

KNOWN = 0.3  # sigma of a logarithm
_SHARPER = 0.5  # sigma over that of the prior, at most
MODEL = {
    "drive_kx": 0.025, "drive_ky": 0.04, "drive_c": 0.1, "drive_mu": DRIVES, "front_k": 0.025, "front_mu": 0.02,
    "back_k": 0.05, "back_mu": 0.03, "c": 0.5, "slip": 0.3,
}  # fmt: skip
_WHEEL = {
    "drive": (("kx", "drive_kx"), ("ky", "drive_ky"), ("cx", "drive_c"), ("cy", "drive_c"), ("mu", "drive_mu")),
    "front": (("kx", "front_k"), ("ky", "front_k"), ("cx", "caster_c"), ("cy", "caster_c"), ("mu", "front_mu")),
    "back": (("kx", "back_k"), ("ky", "back_k"), ("cx", "caster_c"), ("cy", "caster_c"), ("mu", "back_mu")),
}
_UNITS = {"k": "N/m", "c": "N.s/m", "m": "-"}
_BODY = (("body_c", "N.s/m"), ("body_cr", "N.m.s/rad"), ("drive_load", "-"), ("back_load", "-"))


def wheel_parameters(wheels: WheelSet, direction: Direction) -> tuple[Parameter, ...]:
    """The parameters of every wheel, then those of the base."""
    return tuple(_parameter(direction, name, unit, key) for name, unit, key in _named(wheels))


def covariance_of(wheels: WheelSet, direction: Direction) -> np.ndarray:
    """Covariance (p, p) of the values of `wheel_parameters`; wheels of one type have correlation 1."""
    keys = [key for _, _, key in _named(wheels)]
    rows = [NAMES.index(key) for key in keys]
    values = np.exp(direction.logarithms[rows])
    C = direction.covariance + np.diag([_model(name) ** 2 for name in NAMES])
    return C[np.ix_(rows, rows)] * np.outer(values, values)


def _named(wheels: WheelSet) -> Iterator[tuple[str, str, str]]:
    """Name, unit, and which of NAMES it is."""
    for wheel, kind in zip(wheels.names, wheels.types, strict=True):
        for letter, key in _WHEEL[kind]:
            part = "contact" if letter == "mu" else "suspension"
            yield f"{part}.{wheel}.{letter}", _UNITS[letter[0]], key
    for name, unit in _BODY:
        yield f"slip.{name}", unit, name


def _parameter(direction: Direction, name: str, unit: str, key: str) -> Parameter:
    i = NAMES.index(key)
    value = float(np.exp(direction.logarithms[i]))
    sigma = float(np.hypot(np.sqrt(direction.covariance[i, i]), _model(key)))
    known = direction.is_of_wheels and sigma < min(KNOWN, _SHARPER * PRIOR_SIGMA[i])
    status: Status = "estimated" if known else "not_identifiable"
    return Parameter(name, unit, float(np.exp(PRIOR[i])), value, value * sigma, status)


def _model(key: str) -> float:
    """Error of the model itself, of a logarithm."""
    if key.startswith("body") or key.endswith("_load"):
        return MODEL["slip"]
    return MODEL.get(key, MODEL["c"])
