"""The spin or drive that observes what of a base frame is fixed at nominal.

Its gain is what the stage itself reports of the recorded rests and the suggested ones, those without noise but
with the recorded ones' covariance: a drive that goes straight, a base that turns where it turned. How high the base is
over its markers no motion identifies.

The sweep that would identify a rho whose search ended at a limit.

At the highest limit the flanks change faster than the readings show: sweep so slowly that the joint passes speeds of
1 / rho in many readings. At the lowest its speeds hardly choose a flank: sweep fast. The standard deviation after is
that of rho beside the two flanks, at the limit, from readings every 0.1 s whose errors hang together over a second, or
a quarter of a period where that is shorter:

    J = [dM/drho x, M],   M = [S, 1 - S],   S = 1 / (1 + exp(-rho dq)),   dq = 2 pi f a cos(2 pi f t)

x the flanks at the middle of the model's domain. Flanks that lie together identify no rho at any speed: no sweep is
named.

How many more swings would identify elements of a suspension that the recorded ones leave open; and which none would.

An element's standard deviation is the jackknife's over n trials. With m more trials like them it is

    after = before sqrt(n / (n + m))

and the element is identified when that is below its share of the diagonal pair (`suspension_parameters`). On an axis
whose motion springs do not explain, because wheels slip there, no number of trials identifies a spring. Nor does one
total wrench separate the wheels: that takes a plate under each.
"""

from collections.abc import Sequence

import numpy as np

from calibration.design.information import SAMPLES
from calibration.inference.parameters import Model
from calibration.mocap.cluster_pose import body_poses
from calibration.numerics.lie import compose, from_vector, inverse
from calibration.recording.experiment import ExperimentPlan, Motion, Sigma
from calibration.recording.schema import Description
from calibration.robot.laboratory import Laboratory
from calibration.robot.nominal_frames import AXES, frame_names
from calibration.stages.frames.base_rests import Stations, from_planar
from calibration.stages.frames.base_stage import STAGE, locate_base
from calibration.stages.joints.model import JointModel, monomials
from calibration.stages.joints.separable_fit import RHO, Problem, limit_of
from calibration.stages.suspension.model import Suspension
from calibration.stages.suspension.wheels import KNOWN
from calibration.verdict import Verdict

SPIN = Motion("spin", rests=12, step=float(np.pi / 6.0))
DRIVE = Motion("drive", rests=8, step=0.1)
_JOINTS = "joints"
_PERIODS = 4
_EVERY, _TOGETHER = 0.1, 1.0  # [s] between readings, and over which their errors hang together
_FAST, _SLOW = 1.5, 3.0 / RHO[1]  # peak speeds [rad/s]
_WIDE, _NARROW = 0.4, 0.05  # amplitudes that go with them [rad]
_FALLS = 0.5  # sigma after over before, of a sweep worth naming [-]
_SUSPENSION = "suspension"
_MOST = 3  # times as many trials as were recorded: more is nobody's campaign [-]
_SECONDS, _HERTZ = 25.0, 0.2  # of a swing


def drive_next(
    lab: Laboratory, stations: Stations | None, model: Model | None
) -> tuple[ExperimentPlan | None, tuple[Verdict, ...]]:
    """Motions to record after `model` from `stations`, both None where there are none; None where none is missing."""
    kinds = () if stations is None or model is None else stations.kinds
    motions = tuple(m for m in (SPIN, DRIVE) if m.kind not in kinds)
    if not motions:
        return None, ()
    description, base = lab.description, lab.nominal_frames[:6]
    if model is not None:
        base = np.array([p.value for p in model.parameters[:6]])
    planned = _planned(description, base, motions, stations if kinds else None)
    found, _ = locate_base(lab, planned)
    if found is None:
        return None, ()
    tol, name = description.tolerances, frame_names()[0]
    before = dict.fromkeys(AXES[:3], tol.body_translation) | dict.fromkeys(AXES[3:], tol.body_rotation)
    if model is not None:
        before = {axis: p.sigma for axis, p in zip(AXES, model.parameters, strict=False)}
    rows = [(a, p) for a, p in zip(AXES, found.parameters, strict=False) if p.status == "estimated"]
    sigma = tuple(Sigma(p.name, p.unit, before[a], p.sigma) for a, p in rows if p.sigma < 0.99 * before[a])
    why = f"{name}: components observable only from a {' and a '.join(m.kind for m in motions)} are fixed at nominal"
    remedy = ExperimentPlan(STAGE, why, motions=motions, sigma=sigma)
    expected = ", ".join(f"{s.name} {s.before:.2g} -> {s.after:.2g} {s.unit}" for s in sigma)
    steps = " and ".join(f"a {m.kind} of {m.rests} rests" for m in motions)
    return remedy, (Verdict(STAGE, "warning", f"{why}; {steps} would, in record_next.yaml: {expected}"),)


def _planned(
    description: Description, base: np.ndarray, motions: tuple[Motion, ...], recorded: Stations | None
) -> Stations:
    """The recorded stations with those of motions from the first of them on, the markers at T_base_B = base (6,)."""
    body, n = description.base_body, sum(m.rests for m in motions)
    xyz = np.array([m.xyz for m in body.markers])
    S = body_poses(xyz, xyz[None]).covariance * description.sigmas.marker**2 / SAMPLES
    if recorded is not None:
        S = recorded.covariance.mean(axis=0)[None]
    planar = np.concatenate([_path(m) for m in motions])
    T_base_B, start = from_vector(base), np.eye(4)
    if recorded is not None:
        start = recorded.T[0] @ inverse(T_base_B)
    elif description.plates:
        start = compose(np.eye(3), np.array(description.plates[0].centre))
    T = start @ from_planar(planar) @ T_base_B
    first = 0 if recorded is None else len(recorded.kinds)
    trial = first + np.repeat(np.arange(len(motions)), [m.rests for m in motions])
    new = Stations(
        T,
        np.repeat(S, n, axis=0),
        trial,
        tuple(m.kind for m in motions),
        tuple(m.kind for m in motions),
    )
    if recorded is None:
        return new
    return Stations(
        np.concatenate([recorded.T, new.T]),
        np.concatenate([recorded.covariance, new.covariance]),
        np.concatenate([recorded.trial, new.trial]),
        recorded.kinds + new.kinds,
        recorded.ids + new.ids,
    )


def _path(motion: Motion) -> np.ndarray:
    """Planar poses (rests, 3) [m, m, rad]."""
    along = motion.step * np.arange(motion.rests)
    zero = np.zeros(motion.rests)
    return np.column_stack([zero, zero, along] if motion.kind == "spin" else [along, zero, zero])


def sweeps_next(models: Sequence[JointModel]) -> tuple[ExperimentPlan | None, tuple[Verdict, ...]]:
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
    verdicts = []
    if beyond:
        message = (
            f"rho of {', '.join(beyond)}: no sweep identifies it, the flanks are too near each other for the noise"
        )
        verdicts.append(Verdict(_JOINTS, "warning", message))
    if not motions:
        return None, tuple(verdicts)
    why = f"rho is not identifiable in {', '.join(m.joint for m in motions)}"
    expected = ", ".join(f"{s.name} {s.before:.0f} -> {s.after:.2g} {s.unit}" for s in sigma)
    verdicts.append(
        Verdict(_JOINTS, "warning", f"{why}; to identify it, record the sweeps in record_next.yaml: {expected}")
    )
    return ExperimentPlan(_JOINTS, why, motions=tuple(motions), sigma=tuple(sigma)), tuple(verdicts)


def sweep(model: JointModel) -> Motion:
    """A sine of the joint, slow or fast."""
    speed, amplitude = (_SLOW, _NARROW) if limit_of(model.rho) == "highest" else (_FAST, _WIDE)
    frequency = speed / (2.0 * np.pi * amplitude)
    return Motion("sweep", joint=model.joint, amplitude=amplitude, frequency=frequency, seconds=_PERIODS / frequency)


def predicted_sigma(model: JointModel, motion: Motion) -> float:
    """Standard deviation of rho after a sweep [s/rad]; infinite where it would not identify it."""
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


def swings_next(suspension: Suspension) -> tuple[ExperimentPlan | None, tuple[Verdict, ...]]:
    """Swings for the elements that scatter between trials; None where there is none, or too many would be needed."""
    held_out = suspension.held_out[0][1]
    n, slips = len(held_out.error), held_out.slips
    open_ = {p.name: p for p in suspension.parameters if p.status == "not_identifiable"}
    needed, slipping = {}, []
    for letter, matrix in (("K", suspension.K), ("C", suspension.C)):
        root = np.sqrt(np.abs(np.diag(matrix)))
        for i, j in zip(*np.triu_indices(6), strict=True):
            name = f"suspension.{letter}.{i + 1}{j + 1}"
            if name in open_ and (slips[i] or slips[j]):
                slipping.append(name)
            elif name in open_:
                ratio = open_[name].sigma / (KNOWN * root[i] * root[j])
                needed[name] = int(np.ceil(n * max(0.0, ratio**2 - 1.0))) + 1
    verdicts = []
    if slipping:
        axes = ", ".join(name for name, slip in zip(AXES, slips, strict=True) if slip)
        message = (
            f"{len(slipping)} elements of K and C: the motion excites no spring along {axes}: these slip or hardly move"
        )
        verdicts.append(Verdict(_SUSPENSION, "warning", message))
    wheels = [name for name in open_ if name not in needed and name not in slipping]
    if wheels:
        message = (
            f"{', '.join(wheels)}: the total wrench does not distinguish the wheels; a plate under each wheel would"
        )
        verdicts.append(Verdict(_SUSPENSION, "warning", message))
    within = {name: m for name, m in needed.items() if m <= _MOST * n}
    if not within:
        return None, tuple(verdicts)
    m = max(within.values())
    share = float(np.sqrt(n / (n + m)))
    sigma = tuple(Sigma(x, open_[x].unit, open_[x].sigma, share * open_[x].sigma) for x in within)
    why = f"not identifiable: {', '.join(within)}"
    verdicts.append(
        Verdict(
            _SUSPENSION,
            "warning",
            f"{why}; to identify it, record {m} more swings like the {n} recorded (record_next.yaml)",
        )
    )
    motions = (Motion("swing", repeats=m, frequency=_HERTZ, seconds=_SECONDS),)
    return ExperimentPlan(_SUSPENSION, why, motions=motions, sigma=sigma), tuple(verdicts)
