"""Data that cannot be what they say, told by name before a spring is fitted to them.

sign       at rest the robot presses down: Fz < 0 (ACTION on the plate), and each component follows the nominal
           inverse dynamics, not its mirror image
place      its centre of pressure lies between the wheels' contact points
rotation   psi = atan2(sum m_d x m_p, sum m_d . m_p) from the horizontal moments of dynamics to those of the plate,
           about the plate's centre; the median over trials, since a base that slips in one turns its moments
moved      the base rests where it rested before: more than slip has happened when it does not
"""

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from calibration.numerics.lie import adjoint
from calibration.numerics.signals import RATE, Signal, interpolate_columns, low_passed
from calibration.recording.schema import Description
from calibration.recording.trial import REST
from calibration.stages.suspension.base_response import Forcing, Sway
from calibration.verdict import Verdict

STAGE = "suspension"
_SLOW = 2.5  # [Hz] below the base's resonance, where plate and dynamics agree
_OUTSIDE = 0.03  # [m] the centre of pressure may be outside the wheels
_WEIGHT = 1.4  # believable ratio of measured to nominal weight, or its inverse [-]
_TURNED, _WRONG = np.radians(4.0), np.radians(20.0)  # plate to lab: doubtful, not usable [rad]
_MIRRORED = -0.5  # correlation [-]
_ALIKE = 0.7  # share of common motion of two pairs of moments between which an angle means something [-]
_FAINT = (1.0, 0.5)  # rms force [N] and moment [N.m] that say nothing of a sign
_SHIFTED, _TWISTED = 15e-3, 0.1  # rest pose after against before: slip alone reaches 6 mm, 30 mrad [m, rad]
_NAMES = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")


def wrong_plate(description: Description, plate: Sequence[Forcing], dynamics: Sequence[Forcing]) -> Iterator[Verdict]:
    """What is wrong with the plate's wrench; trials in the same order in both, or no dynamics at all."""
    rest = np.median([f.rest for f in plate], axis=0)
    if rest[2] > 0.0:
        message = (
            f"plate sign: Fz = {rest[2]:+.0f} N at rest, it must be the action of the robot ON the plate; negate it"
        )
        yield Verdict(STAGE, "refused", message)
    elif dynamics:
        yield from _against_dynamics(description, rest, plate, dynamics)
    elif (outside := _outside(description, np.array([-rest[4], rest[3]]) / rest[2])) > _OUTSIDE:
        yield Verdict(STAGE, "refused", _misplaced(outside))


def _against_dynamics(
    description: Description, rest: np.ndarray, plate: Sequence[Forcing], dynamics: Sequence[Forcing]
) -> Iterator[Verdict]:
    weight = -float(np.median([f.rest[2] for f in dynamics]))
    if not 1.0 / _WEIGHT < -rest[2] / weight < _WEIGHT:
        message = f"plate scale: it carries {-rest[2]:.0f} N, the nominal robot weighs {weight:.0f} N"
        yield Verdict(STAGE, "refused", message)
        return
    pairs = _slow(plate, dynamics)
    p, d = (np.concatenate(a) for a in zip(*pairs, strict=True))
    mirrored = [name for k, name in enumerate(_NAMES) if _is_mirrored(k, p[:, k], d[:, k])]
    psi = _turn([(d[:, 3:5], p[:, 3:5]) for p, d in pairs])
    outside = _outside(description, np.array([-rest[4], rest[3]]) / rest[2])
    if abs(psi) > _WRONG:
        message = f"plate rotated by {np.degrees(psi):.0f} deg about the vertical against the lab: turn its axes"
        yield Verdict(STAGE, "refused", message)
    elif mirrored:
        message = f"plate sign: {', '.join(mirrored)} mirror what the robot's motion does; negate them"
        yield Verdict(STAGE, "refused", message)
    elif outside > _OUTSIDE:
        yield Verdict(STAGE, "refused", _misplaced(outside))
    elif abs(psi) > _TURNED:
        message = f"plate rotated by {np.degrees(psi):.1f} deg about the vertical against the lab"
        yield Verdict(STAGE, "warning", message)


def _misplaced(outside: float) -> str:
    return f"plate place: its centre of pressure is {1e3 * outside:.0f} mm outside the wheels; see plate_centre"


def moved_bases(sways: Sequence[Sway]) -> dict[str, str]:
    """Trials after which the base stands elsewhere, and by how much."""
    found = {}
    for sway in sways:
        if how := moved_by(sway.x[-int(0.5 * REST * RATE) :].mean(axis=0)):
            found[sway.trial_id] = how
    return found


def moved_by(after: np.ndarray) -> str:
    """By how much a base moved that stands at (6,) [m, rad] from where it rested before; empty if slip explains it."""
    shift, turn = float(np.linalg.norm(after[:3])), float(np.linalg.norm(after[3:]))
    return f"{1e3 * shift:.1f} mm, {1e3 * turn:.0f} mrad" if shift > _SHIFTED or turn > _TWISTED else ""


def _slow(plate: Sequence[Forcing], dynamics: Sequence[Forcing]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Slow changes of both wrenches (n, 6) as the plate reads them, about its centre, at common times, by trial."""
    rows = []
    for p, d in zip(plate, dynamics, strict=True):
        slow_p, slow_d = (low_passed(Signal(f.t, f.w, np.ones(len(f.t), bool)), _SLOW).x for f in (p, d))
        to_plate = adjoint(p.T_0_plate).T  # of a wrench: Ad(T_0_plate)' maps it from frame 0
        slow_p, slow_d = slow_p @ to_plate.T, slow_d @ to_plate.T
        inside = (d.t >= p.t[0]) & (d.t <= p.t[-1])
        at = interpolate_columns(d.t[inside], p.t, slow_p)
        rows.append((at, slow_d[inside]))
    return rows


def _turn(pairs: Sequence[tuple[np.ndarray, np.ndarray]]) -> float:
    """Angle [rad] from d to p, (n, 2) each, the median over the trials that are loud enough to show one."""
    whole = _angle(*(np.concatenate(a) for a in zip(*pairs, strict=True)))
    loud = [(d, p) for d, p in pairs if min(d.std(axis=0).max(), p.std(axis=0).max()) > _FAINT[1]]
    off = [np.angle(np.exp(1j * (psi - whole))) for d, p in loud if (psi := _angle(d, p)) != 0.0]
    return whole + float(np.median(off)) if off else whole


def _angle(d: np.ndarray, p: np.ndarray) -> float:
    """Angle from d to p (n, 2) [rad]; 0 where they do not show the same motion, or rather its mirror image."""
    turned = complex(np.vdot(d[:, 0] + 1j * d[:, 1], p[:, 0] + 1j * p[:, 1]))
    mirrored = complex(np.vdot(d[:, 0] - 1j * d[:, 1], p[:, 0] + 1j * p[:, 1]))
    alike = abs(turned) > max(_ALIKE * float(np.linalg.norm(d) * np.linalg.norm(p)), abs(mirrored))
    return float(np.angle(turned)) if alike else 0.0


def _is_mirrored(k: int, p: np.ndarray, d: np.ndarray) -> bool:
    faint = _FAINT[0] if k < 3 else _FAINT[1]
    if min(p.std(), d.std()) < faint:
        return False
    return bool(np.corrcoef(p, d)[0, 1] < _MIRRORED)


def _outside(description: Description, cop: np.ndarray) -> float:
    """How far a point (2,) is outside the polygon of the wheels' contacts [m]; 0 where no polygon is declared."""
    contacts = np.array([w.contact[:2] for w in description.wheels])
    if len(contacts) < 3:
        return 0.0
    try:
        sides = ConvexHull(contacts).equations
    except QhullError:
        return 0.0
    return max(0.0, float((sides[:, :2] @ cop + sides[:, 2]).max()))
