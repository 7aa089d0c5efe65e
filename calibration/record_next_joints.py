"""The sweep that would tell a rho whose search ended at a limit.

At the highest limit the flanks change faster than the readings show: sweep so slowly that the joint passes speeds of
1 / rho in many readings. At the lowest its speeds hardly choose a flank: sweep fast. The standard deviation after is
that of rho beside the two flanks, at the limit, from readings every 0.1 s whose errors hang together over a second, or
a quarter of a period where that is shorter:

    J = [dM/drho x, M],   M = [S, 1 - S],   S = 1 / (1 + exp(-rho dq)),   dq = 2 pi f a cos(2 pi f t)

x the flanks at the middle of the model's domain. Flanks that lie together tell no rho at any speed: no sweep is named.
"""

from collections.abc import Sequence

import numpy as np

from calibration.joint_model import JointModel, monomials
from calibration.joint_projection import RHO, Problem, limit_of
from calibration.remedy import Motion, Remedy, Sigma
from calibration.verdict import Verdict

STAGE = "joints"
_PERIODS = 4
_EVERY, _TOGETHER = 0.1, 1.0  # [s] between readings, and over which their errors hang together
_FAST, _SLOW = 1.5, 3.0 / RHO[1]  # peak speeds [rad/s]
_WIDE, _NARROW = 0.4, 0.05  # amplitudes that go with them [rad]
_FALLS = 0.5  # sigma after over before, of a sweep worth naming [-]


def sweeps_next(models: Sequence[JointModel]) -> tuple[Remedy | None, tuple[Verdict, ...]]:
    """Sweeps for the joint models whose rho is at a limit; None where there is none, or none would help."""
    motions, sigma, beyond = [], [], []
    for model in (m for m in models if m.powers and limit_of(m.rho)):
        motion = sweep(model)
        before, after = (RHO[1] - RHO[0]) / np.sqrt(12.0), predicted_sigma(model, motion)
        if after < _FALLS * before:
            motions.append(motion)
            sigma.append(Sigma(f"sigmoid.{model.joint}.rho", "s/rad", float(before), after))
        else:
            beyond.append(model.joint)
    said = []
    if beyond:
        message = f"rho of {', '.join(beyond)}: no sweep would tell, the flanks lie too near each other for the noise"
        said.append(Verdict(STAGE, "warning", message))
    if not motions:
        return None, tuple(said)
    why = f"rho is not identifiable in {', '.join(m.joint for m in motions)}"
    told = ", ".join(f"{s.name} {s.before:.0f} -> {s.after:.2g} {s.unit}" for s in sigma)
    said.append(Verdict(STAGE, "warning", f"{why}; sweeps that would tell, in record_next.yaml: {told}"))
    return Remedy(STAGE, why, motions=tuple(motions), sigma=tuple(sigma)), tuple(said)


def sweep(model: JointModel) -> Motion:
    """A sine of the joint, slow or fast."""
    speed, amplitude = (_SLOW, _NARROW) if limit_of(model.rho) == "highest" else (_FAST, _WIDE)
    frequency = speed / (2.0 * np.pi * amplitude)
    return Motion("sweep", joint=model.joint, amplitude=amplitude, frequency=frequency, seconds=_PERIODS / frequency)


def predicted_sigma(model: JointModel, motion: Motion) -> float:
    """Standard deviation of rho after a sweep [s/rad]; infinite where it would tell nothing."""
    t = np.arange(0.0, motion.seconds, _EVERY)
    w = 2.0 * np.pi * motion.frequency
    v = w * motion.amplitude * np.cos(w * t)
    middle = model.domain.mean(axis=1)
    M = monomials(middle[:1], middle[1:], model.powers)
    x = np.array([(M @ model.A)[0], (M @ model.B)[0]])
    problem = Problem(np.ones((len(t), 1)), v, np.zeros(len(t)))
    J = np.column_stack([problem.design_slope(model.rho) @ x, problem.design(model.rho)])
    together = max(1.0, min(_TOGETHER, 0.25 / motion.frequency) / _EVERY)
    scale = np.maximum(np.linalg.norm(J, axis=0), np.finfo(float).tiny)
    H = (J / scale).T @ (J / scale)
    if np.linalg.cond(H) > 1e12:
        return float("inf")
    return float(model.quality.residual * np.sqrt(together * np.linalg.inv(H)[0, 0]) / scale[0])
