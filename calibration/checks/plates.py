"""Force-plate readings that cannot be what they say, and bases that moved, named before a spring is fitted to them.

samples    whole
weight     that of the nominal robot, by its masses' tolerances; what it is off within them is in the springs' intervals
sign       at rest the robot presses down: Fz < 0 (ACTION on the plate), and each component follows the nominal
           inverse dynamics, not its mirror image
place      its centre of pressure lies between the wheels' contact points
rotation   psi = atan2(sum m_d x m_p, sum m_d . m_p) from the horizontal moments of dynamics to those of the plate,
           about the plate's centre; the median over trials, since a base that slips in one turns its moments
links      the moments change by what the nominal links' motion makes of them, by their masses' tolerances
moved      the base rests where it rested before: more than slip has happened when it does not
"""

from collections.abc import Iterator, Sequence
from typing import Protocol

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from calibration.inference.parameters import Model
from calibration.numerics.lie import adjoint
from calibration.numerics.signals import Signal, interpolate_columns, low_passed
from calibration.recording.schema import Description
from calibration.recording.trial import Trial
from calibration.robot.laboratory import Laboratory
from calibration.verdict import Direction, Verdict

STAGE = "suspension"
# What the `moves` of a warning say of a plate: error of its scale [-], its angle about the vertical [rad]; of the links
# that move: error of their masses [-].
SCALE, TURN, MASSES = "plate.scale", "plate.turn", "links.masses"
_LOAD = 3.0  # believable ratio of the plates' load to the robot's weight, or its inverse, in any units
_SLOW = 2.5  # [Hz] below the base's resonance, where plate and dynamics agree
_OUTSIDE = 0.03  # [m] the centre of pressure may be outside the wheels
_WEIGHT = 1.4  # believable ratio of measured to nominal weight, or its inverse [-]
_NEAR = 0.07  # [m] between a wheel and the centre of pressure of what a plate misses
_SURE = 2.5  # standard deviations of the nominal weight
_BORNE = 0.1  # share of the weight that a wheel may bear [-]
_TURNED, _WRONG = np.radians(4.0), np.radians(20.0)  # plate to lab: doubtful, not usable [rad]
_MIRRORED = -0.5  # correlation [-]
_ALIKE = 0.7  # share of common motion of two pairs of moments between which an angle means something [-]
_SAME = 0.9  # correlation of two pairs of moments between which a factor means something; 0.99 is usual
_STAYS, _FEW = 0.2, 100  # share of samples at the largest or least reading; samples that show one
_FAINT = (1.0, 0.5)  # rms force [N] and moment [N.m] that say nothing of a sign
_SHIFTED, _TWISTED = 15e-3, 0.1  # rest pose after against before: slip alone reaches 6 mm, 30 mrad [m, rad]
_OF_BASE = ("suspension.", "slip.")  # parameters fitted to the plate's wrench
_OF_LOADS = ("gear.", "friction.", "hysteresis.", "flexibility.")  # to torques of the nominal links
_NAMES = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")


class Wrenched(Protocol):
    """A wrench on the floor in one trial, as `suspension.base_response.Forcing`: see there."""

    @property
    def t(self) -> np.ndarray:
        """Times (n,) [s, mocap clock]."""

    @property
    def w(self) -> np.ndarray:
        """Change of the wrench (n, 6) since the first second [N, N.m, frame 0]."""

    @property
    def rest(self) -> np.ndarray:
        """Wrench (6,) in the first second."""

    @property
    def T_0_plate(self) -> np.ndarray:  # noqa: N802
        """Centre of the first plate and axes of its readings (4, 4)."""


def implausible_plates(trial: Trial, weight: float) -> Iterator[str]:
    """Why the plates of a trial cannot be used; `weight` of the nominal robot [N], 0 where its links have no masses."""
    bad = np.flatnonzero(~np.isfinite(trial.plate_wrench).all(axis=(1, 2)))
    if len(bad):
        yield f"plate: {len(bad)} samples are missing, the first is {bad[0]}; cut them out, or leave the plate out"
    if not len(trial.t_plate):
        return
    load = -float(np.median(trial.plate_wrench[:, :, 2].sum(axis=1)))
    if not np.isfinite(load):
        return
    if load < 0.0:
        yield (
            f"plate: Fz is {-load:+.0f} N on a robot that weighs {weight:.0f} N: its wrench is the reaction, or the "
            "plate is upside down; see convention and axes"
        )
    elif weight and not weight / _LOAD < load < weight * _LOAD:
        yield f"plate carries {load:.3g} N, the nominal robot weighs {weight:.0f} N; see the plate's units and labels"


def saturated(trial: Trial) -> Iterator[str]:
    """Channels of the plates that stay at their largest or least reading; a channel of zeros is not measured."""
    if len(trial.t_plate) < _FEW:
        return
    for name, channel in zip(_NAMES, np.moveaxis(trial.plate_wrench, 2, 0), strict=True):
        for end in {*channel.max(axis=0).tolist(), *channel.min(axis=0).tolist()} - {0.0}:
            if (share := float((channel == end).any(axis=1).mean())) > _STAYS:
                yield f"plate: {name} stays at {end:.4g} in {100.0 * share:.0f} % of the samples: saturated, or stuck"


def wrong_plate(lab: Laboratory, plate: Sequence[Wrenched], dynamics: Sequence[Wrenched]) -> Iterator[Verdict]:
    """What is wrong with the plate's wrench; trials in the same order in both, or no dynamics at all."""
    rest = np.median([f.rest for f in plate], axis=0)
    if rest[2] > 0.0:
        message = (
            f"plate sign: Fz = {rest[2]:+.0f} N at rest, it must be the action of the robot ON the plate; negate it"
        )
        yield Verdict(STAGE, "refused", message)
    elif dynamics:
        yield from _against_dynamics(lab, rest, plate, dynamics)
    elif (outside := _outside(lab.description, np.array([-rest[4], rest[3]]) / rest[2])) > _OUTSIDE:
        yield Verdict(STAGE, "refused", _misplaced(outside))


def _against_dynamics(
    lab: Laboratory, rest: np.ndarray, plate: Sequence[Wrenched], dynamics: Sequence[Wrenched]
) -> Iterator[Verdict]:
    weight = -float(np.median([f.rest[2] for f in dynamics]))
    if not 1.0 / _WEIGHT < -rest[2] / weight < _WEIGHT:
        message = f"plate scale: it carries {-rest[2]:.0f} N, the nominal robot weighs {weight:.0f} N"
        yield Verdict(STAGE, "refused", message)
        return
    yield from _weighed(lab, rest, dynamics, weight)
    slow = _slow(plate, dynamics)
    yield from _driven(lab, rest, slow)
    if abs(-rest[2] / weight - 1.0) <= _SURE * weight_spread(lab):
        yield from _moving(lab, slow)


def _weighed(lab: Laboratory, rest: np.ndarray, dynamics: Sequence[Wrenched], weight: float) -> Iterator[Verdict]:
    """A load that is not the robot's, whose nominal weight is given [N]."""
    spread, ratio = weight_spread(lab), float(-rest[2] / weight)
    off = _off_plate(lab.description, rest - np.median([f.rest for f in dynamics], axis=0))
    message = f"it carries {-rest[2]:.0f} N, the nominal robot weighs {weight:.0f} +- {weight * spread:.0f} N"
    moves = (((SCALE, ratio - 1.0),),)
    if abs(ratio - 1.0) <= (min(_BORNE, _SURE * spread) if off else _SURE * spread):
        yield Verdict(STAGE, "ok", f"plate: {message}; intervals of springs include the difference", moves)
        return
    message = f"plate scale: {message}: springs would be off by as much; see its gain, or a load nobody declared"
    message += f"; what is missing is as if {off} stood off the plate" if off else ""
    yield Verdict(STAGE, "warning", message, moves)


def _driven(lab: Laboratory, rest: np.ndarray, pairs: Sequence[tuple[np.ndarray, np.ndarray]]) -> Iterator[Verdict]:
    """Slow changes of the plate's wrench that are not those of the robot's motion."""
    p, d = (np.concatenate(a) for a in zip(*pairs, strict=True))
    mirrored = [name for k, name in enumerate(_NAMES) if _is_mirrored(k, p[:, k], d[:, k])]
    psi = _turn([(d[:, 3:5], p[:, 3:5]) for p, d in pairs])
    outside = _outside(lab.description, np.array([-rest[4], rest[3]]) / rest[2])
    loud, ratio = float(np.linalg.norm(d[:, 3:5].std(axis=0))), float(np.linalg.norm(p[:, 3:5].std(axis=0)))
    ratio /= max(loud, np.finfo(float).tiny)
    if abs(psi) > _WRONG:
        message = f"plate rotated by {np.degrees(psi):.0f} deg about the vertical against the lab: turn its axes"
        yield Verdict(STAGE, "refused", message)
    elif mirrored:
        message = f"plate sign: {', '.join(mirrored)} mirror what the robot's motion does; negate them"
        yield Verdict(STAGE, "refused", message)
    elif outside > _OUTSIDE:
        yield Verdict(STAGE, "refused", _misplaced(outside))
    elif loud > 4.0 * _FAINT[1] and not 1.0 / _LOAD < ratio < _LOAD:
        message = f"plate scale: its moments change by {ratio:.2g} of those of the robot's motion; see their unit"
        yield Verdict(STAGE, "refused", message)
    elif abs(psi) > _TURNED:
        message = f"plate rotated by {np.degrees(psi):.1f} deg about the vertical against the lab"
        yield Verdict(STAGE, "warning", message, (((TURN, psi),),))


def _moving(lab: Laboratory, pairs: Sequence[tuple[np.ndarray, np.ndarray]]) -> Iterator[Verdict]:
    """Links that move and weigh otherwise than they nominally do: p = ratio d, moments of plate and dynamics."""
    p, d = (np.concatenate([x[:, 3:5] - x[:, 3:5].mean(axis=0) for x in of]) for of in zip(*pairs, strict=True))
    if np.linalg.norm(d.std(axis=0)) < 4.0 * _FAINT[1]:
        return
    links = np.array([inertia.mass for inertia in lab.floating.inertias])[2:]
    spread = lab.description.tolerances.link_mass * float(np.linalg.norm(links) / links.sum())
    ratio, alike = float((p * d).sum() / (d**2).sum()), float((p * d).sum() / np.sqrt((p**2).sum() * (d**2).sum()))
    if alike > _SAME and abs(ratio - 1.0) > _SURE * spread:
        message = (
            f"plate: its load is right, but as the arm moves its moments change {ratio:.2f} times as much as by the "
            f"URDF's masses: the arm weighs {ratio:.2f} times what it says (another make?), or the plate's moments "
            "have a gain; gears, friction and predictions from dynamics are off by as much: correct the masses"
        )
        yield Verdict(STAGE, "warning", message, (((MASSES, ratio - 1.0),),))


def weight_spread(lab: Laboratory) -> float:
    """Standard deviation of the robot's weight over it [-], by the datasheet's tolerances of its masses."""
    masses = np.array([inertia.mass for inertia in lab.floating.inertias])
    payload = lab.description.payload
    known = payload.tolerance if payload is not None else 0.0
    return float(np.hypot(lab.description.tolerances.link_mass * np.linalg.norm(masses), known) / masses.sum())


def _off_plate(description: Description, missing: np.ndarray) -> str:
    """The wheel that bears a missing wrench (6,), Fz > 0; empty where none is near its centre of pressure."""
    if not description.wheels or missing[2] <= 0.0:
        return ""
    cop = np.array([-missing[4], missing[3]]) / missing[2]
    far = [float(np.linalg.norm(np.array(w.contact[:2]) - cop)) for w in description.wheels]
    return description.wheels[int(np.argmin(far))].name if min(far) < _NEAR else ""


def _misplaced(outside: float) -> str:
    return f"plate place: its centre of pressure is {1e3 * outside:.0f} mm outside the wheels; see plate_centre"


def by_scale(model: Model, moved: Sequence[Direction]) -> tuple[Direction, ...]:
    """Directions in which a plate's scale is that of the base's springs and dampers, that of masses the gears'."""
    forces = [p for p in model.parameters if p.name.startswith(_OF_BASE) and p.unit.startswith("N")]
    loads = [p for p in model.parameters if p.name.startswith(_OF_LOADS)]
    scaled = {SCALE: forces, MASSES: loads}
    sizes = [(scaled[name], size) for direction in moved for name, size in direction if name in scaled]
    return (*moved, *(tuple((p.name, size * p.value) for p in found) for found, size in sizes))


def moved_by(after: np.ndarray) -> str:
    """By how much a base moved that stands at (6,) [m, rad] from where it rested before; empty if slip explains it."""
    shift, turn = float(np.linalg.norm(after[:3])), float(np.linalg.norm(after[3:]))
    return f"{1e3 * shift:.1f} mm, {1e3 * turn:.0f} mrad" if shift > _SHIFTED or turn > _TWISTED else ""


def _slow(plate: Sequence[Wrenched], dynamics: Sequence[Wrenched]) -> list[tuple[np.ndarray, np.ndarray]]:
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
