"""Motions of the base: a spin over one turn and a straight drive, in steps with rests between, the arm folded."""

import numpy as np

import mjcf
from calibration.recording import schema
from twin.defects.wheels.rolling_wheel import DRIVES
from twin.motions.campaign import Campaign, Form
from twin.motions.motion import RATE, BasePath, Motion, path_time
from twin.motions.swings import JOINTS

FOLDED = (0.15, 0.20, -1.34, -0.20, 1.94, -1.57, 1.37, 0.0)  # the arm against the chest, the posture for driving


def differential_drive() -> tuple[float, float]:
    """Track and wheel radius of the nominal robot [m]."""
    left, right = (next(w for w in mjcf.wheels() if w.name == name) for name in DRIVES)
    return left.centre[1] - right.centre[1], left.radius


def trials(campaign: Campaign) -> tuple[Motion, ...]:
    """A spin and a drive of each form, in calibration's role."""
    d = campaign.driving
    turn = 2.0 * np.pi / d.spin_rests
    found = []
    for form in d.forms:
        found.append(_stepped("spin", form, d.spin_rests, np.array([0.0, 0.0, turn]), turn / d.yaw_rate, campaign))
        found.append(
            _stepped("drive", form, d.drive_rests, np.array([d.stride, 0.0, 0.0]), d.stride / d.speed, campaign)
        )
    return tuple(found)


def _stepped(
    kind: schema.Kind, form: Form, rests: int, step: np.ndarray, duration: float, campaign: Campaign
) -> Motion:
    """Rests with equal steps (3,) between them, each of `duration` [s] and one ramp."""
    ramp, dwell = campaign.driving.ramp, campaign.dwell
    move = float(np.ceil(RATE * (max(duration, ramp) + ramp)) / RATE)
    t = np.arange(1, round(move * RATE) + 1) / RATE
    s = path_time(t, move, ramp) / (move - ramp)
    still = np.zeros((round(campaign.rest * RATE) + 1, 3))
    pieces, dwells, clock = [still], [(0.0, campaign.rest)], campaign.rest
    for k in range(1, rests):
        pieces += [(k - 1 + s)[:, None] * step, np.repeat(k * step[None], round(dwell * RATE), axis=0)]
        clock += move + dwell
        dwells.append((clock - dwell, clock))
    planar = np.concatenate(pieces)
    return Motion(
        id=f"{kind}_{form}",
        role="calibration",
        kind=kind,
        name=f"{kind}_{form}",
        command=np.repeat(np.array(FOLDED)[None], len(planar), axis=0),
        dwells=np.array(dwells),
        approach=np.zeros((rests, len(JOINTS)), dtype=np.int8),
        base=BasePath(planar),
        kinematic=form == "kinematic",
    )
