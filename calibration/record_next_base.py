"""The spin or drive that would tell what a base frame holds at its drawing.

What it would tell is what the stage itself says of the recorded rests and the suggested ones, those without noise but
with the recorded ones' covariance: a drive that goes straight, a base that turns where it turned. How high the base is
over its markers no motion tells.
"""

import numpy as np

from calibration.base_frame_stage import STAGE, locate_base
from calibration.base_motion import Stations
from calibration.base_poses import from_planar
from calibration.bodies import body_poses
from calibration.estimate import Model
from calibration.information import SAMPLES
from calibration.markers import base_body
from calibration.parameters import AXES, frame_names, nominal_frames
from calibration.remedy import Motion, Remedy, Sigma
from calibration.robot import Chain
from calibration.schema import Description
from calibration.se3 import compose, from_vector, inverse
from calibration.verdict import Verdict

SPIN = Motion("spin", rests=12, step=float(np.pi / 6.0))
DRIVE = Motion("drive", rests=8, step=0.1)


def drive_next(
    chain: Chain, description: Description, stations: Stations | None, model: Model | None
) -> tuple[Remedy | None, tuple[Verdict, ...]]:
    """Motions to record after `model` from `stations`, both None where there are none; None where none is missing."""
    kinds = () if stations is None or model is None else stations.kinds
    motions = tuple(m for m in (SPIN, DRIVE) if m.kind not in kinds)
    if not motions:
        return None, ()
    base = nominal_frames(chain, description)[:6]
    if model is not None:
        base = np.array([p.value for p in model.parameters[:6]])
    planned = _planned(description, base, motions, stations if kinds else None)
    found, _ = locate_base(chain, description, planned)
    if found is None:
        return None, ()
    tol, name = description.tolerances, frame_names()[0]
    before = dict.fromkeys(AXES[:3], tol.body_translation) | dict.fromkeys(AXES[3:], tol.body_rotation)
    if model is not None:
        before = {axis: p.sigma for axis, p in zip(AXES, model.parameters, strict=False)}
    rows = [(a, p) for a, p in zip(AXES, found.parameters, strict=False) if p.status == "estimated"]
    sigma = tuple(Sigma(p.name, p.unit, before[a], p.sigma) for a, p in rows if p.sigma < 0.99 * before[a])
    why = f"{name} is held at its drawing in what only a {' and a '.join(m.kind for m in motions)} tell"
    remedy = Remedy(STAGE, why, motions=motions, sigma=sigma)
    told = ", ".join(f"{s.name} {s.before:.2g} -> {s.after:.2g} {s.unit}" for s in sigma)
    steps = " and ".join(f"a {m.kind} of {m.rests} rests" for m in motions)
    return remedy, (Verdict(STAGE, "warning", f"{why}; {steps} would, in record_next.yaml: {told}"),)


def _planned(
    description: Description, base: np.ndarray, motions: tuple[Motion, ...], recorded: Stations | None
) -> Stations:
    """The recorded stations with those of motions from the first of them on, the markers at T_base_B = base (6,)."""
    body, n = base_body(description), sum(m.rests for m in motions)
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
