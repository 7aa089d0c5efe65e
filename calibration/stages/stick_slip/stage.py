"""Stage `stick_slip`: the base that slips in the floor's plane, from calibration trials alone.

1  forcing of every trial by each source of the wrench, tilt and heave by the suspension's 6x6 compliance, which is
   fitted again where wheels lift off
2  parameters by wheel type, ensemble and band by each source: the plate first, inverse dynamics from its optimum
3  verdicts: the worth of each axis on trials that were left out, against a base that stays
"""

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from calibration.errors import NotEnoughData
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.numerics.side_by_side import side_by_side
from calibration.recording.schema import Description
from calibration.recording.trial import Trial
from calibration.stages.stick_slip.band import PlainBand, heave_band, plain_band, reached
from calibration.stages.stick_slip.fit import BETTER, fit_direction, linear_where
from calibration.stages.stick_slip.forcing import (
    PlanarForcing,
    Tilting,
    heave_apart,
    planar_forcing,
    wrenches_of,
)
from calibration.stages.stick_slip.likelihood import Trials, bases_of, joined
from calibration.stages.stick_slip.measured import PlanarMotion, blocks, planar_motion, pooled_noise, slid
from calibration.stages.stick_slip.model import EXPLAINED, Direction, StickSlip
from calibration.stages.stick_slip.poses import Arm, moving_links
from calibration.stages.stick_slip.search import elsewhere, holding, searched, shifts_of_wheels, warmed
from calibration.stages.stick_slip.standing import SOURCES, Read, tilting_of, vertical_stiffness
from calibration.stages.stick_slip.wheels import FORCE, HELD, WheelSet, wheel_set
from calibration.stages.suspension.base_response import WrenchSources
from calibration.stages.suspension.model import Source, Suspension
from calibration.stages.suspension.rest_frame import rest_of
from calibration.verdict import Verdict

STAGE = "stick_slip"
_AXES = ("x", "y", "yaw")
_LEAST_TRIALS, _LEAST_WHEELS = 2, 3
_LESS, _BY_CHANCE = 0.1, 0.3  # by which R2 of the plate may be less; where it explains yaw
_ALIKE = 0.5  # chi-square over that of the likeliest wheel: either may be it
_FAR, _TURNED = 5e-3, 0.05  # rms [m, rad] beyond which slip does not leave a base
_MUCH = 1.0  # [N] that move the base by tenths of a millimetre where wheels slip
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Campaign:
    """What calibration trials show of the base.

    Attributes:
        wheels: Of the robot.
        read: The trials.
        tilting: Compliance of heave and tilt.
        by_source: Sources of the wrench that two trials show, the trials by each, and the likelihood of its parameters.
    """

    wheels: WheelSet
    read: list[Read]
    tilting: Tilting
    by_source: list[tuple[Source, list[tuple[PlanarForcing, PlanarMotion]], Trials]]


def fit_stick_slip(
    sources: WrenchSources,
    trials: Sequence[Trial],
    suspension: Suspension,
    arm: Arm | None = None,
    rough: np.ndarray | None = None,
) -> tuple[StickSlip | None, list[Read], tuple[Verdict, ...]]:
    """The base by calibration trials in which it is not driven, None where it is not identified, and the findings.

    By inverse dynamics of link angles, where drive trains are known; from rough parameters (17,), where they are. Those
    that show the base are returned as they were read.
    """
    try:
        campaign = campaign_of(sources, trials, suspension, arm)
    except NotEnoughData as error:
        return None, [], (Verdict(STAGE, "missing", str(error)),)
    wheels, read, usable = campaign.wheels, campaign.read, campaign.by_source
    (source, rows, first), *others = usable
    first, best = holding(first, searched(first, rough))
    usable = [(source, rows, first), *((s, r, replace(own, prior=first.prior)) for s, r, own in others)]
    fits = [fit_direction(source, first, best)]
    fits += [fit_direction(source, own, warmed(own, fits[0].logarithms)) for source, _, own in usable[1:]]
    shift, chi2 = shifts_of_wheels(usable[0][2], usable[0][1], fits[0])
    if _behind(fits):
        rows = _rows(sources.lab.description, read, campaign.tilting, "plate", balanced=False)
        alone = replace(joined(wheels, rows, first.prior), corrected=False)
        found = _uncorrected(fits, alone)
        if found is not fits[0]:
            fits[0], usable[0] = found, ("plate", rows, alone)
    directions = [linear_where(fit, suspension) for fit in fits]
    directions = [_banded(d, wheels, rows) for d, (_, rows, _) in zip(directions, usable, strict=True)]
    if len(directions) == len(SOURCES):
        directions[1] = _heaved(directions[1], wheels, campaign.tilting, read)
    model = StickSlip(wheels, campaign.tilting, tuple(directions))
    misplaced = _misplaced(wheels.names, shift, chi2) if directions[0].is_of_wheels else ()
    worth = [_judged(d, own.ids) for d, (_, _, own) in zip(directions, usable, strict=True)]
    findings = (*worth, *misplaced, *_doubted(directions), *_moved(directions[0], usable[0][2].ids))
    return model, read, findings


def campaign_of(
    sources: WrenchSources,
    trials: Sequence[Trial],
    suspension: Suspension,
    arm: Arm | None = None,
    most: int = len(SOURCES),
) -> Campaign:
    """The trials by their wrenches, of `most` sources, the plate first.

    Raises:
        NotEnoughData: Too few wheels are declared, or too few trials show the base and its wrench.
    """
    description = sources.lab.description
    if len(description.wheels) < _LEAST_WHEELS:
        raise NotEnoughData("no stick-slip base: dataset.json declares no wheels")
    wheels = wheel_set(sources.lab.urdf, description.wheels, float(np.linalg.norm(description.gravity)))
    read = _read(sources, trials, suspension, arm)
    tilting, prior = tilting_of(sources, read, wheels, suspension)
    by_source = ((source, _rows(description, read, tilting, source)) for source in SOURCES)
    shown = ((source, rows) for source, rows in by_source if len(rows) >= _LEAST_TRIALS)
    usable = list(islice(shown, most))
    if not usable:
        raise NotEnoughData("no stick-slip base: it takes two trials that show the base and its wrench")
    usual = np.median([forcing.drive[0, 4:6] for forcing, _ in usable[0][1]], axis=0)
    stiffness = vertical_stiffness(wheels, tilting, prior)
    wheels = replace(wheels, shift=tilting.off, usual=usual, vertical=stiffness)
    return Campaign(wheels, read, tilting, [(source, rows, joined(wheels, rows, prior)) for source, rows in usable])


def _read(sources: WrenchSources, trials: Sequence[Trial], suspension: Suspension, arm: Arm | None) -> list[Read]:
    found = side_by_side(lambda trial: _read_one(sources, trial, suspension, arm), trials)
    return [one for one in found if one is not None]


def _read_one(sources: WrenchSources, trial: Trial, suspension: Suspension, arm: Arm | None) -> Read | None:
    """None where its base or wrench is not shown."""
    try:
        seen = MeasuredTrial.of(sources.lab.description, trial)
        rest = rest_of(sources.lab.description, seen, sources.T_base_B)
        wrenches = wrenches_of(sources, seen, rest.T_lab_0, None if arm is None else arm.trains)
        if wrenches.plate is not None:
            far = slid(sources.lab.description, seen, rest, wrenches.plate, suspension)
            wrenches = replace(wrenches, slid=far)
        if arm is not None and arm.trains.trains and sources.robot is not None and wrenches.dynamics is not None:
            wrenches = replace(wrenches, links=moving_links(sources.lab, arm, sources.robot, seen, rest))
        return Read(seen, rest, wrenches)
    except NotEnoughData as error:
        _log.info("%s: %s", trial.id, error)
        return None


def _rows(
    description: Description, read: Sequence[Read], tilting: Tilting, source: Source, balanced: bool = True
) -> list[tuple[PlanarForcing, PlanarMotion]]:
    def row(one: Read) -> tuple[PlanarForcing, PlanarMotion] | None:
        try:
            forcing = planar_forcing(one.wrenches, tilting, source, balanced)
            return forcing, planar_motion(description, one.trial, one.rest, forcing)
        except NotEnoughData as error:
            _log.info("%s from %s: %s", one.trial.id, source, error)
            return None

    return [found for found in side_by_side(row, read) if found is not None]


def _heaved(direction: Direction, wheels: WheelSet, tilting: Tilting, read: Sequence[Read]) -> Direction:
    """By inverse dynamics: heave and tilt err as the plate's do, and as they differ from those.

    Markers hardly show either beside their noise.
    """
    slips = bases_of(wheels, direction.logarithms[None], corrected=False) if direction.slips.any() else None
    found = side_by_side(lambda one: heave_apart(one.wrenches, tilting, slips), read)
    apart, plate = np.array([squares for squares in found if squares is not None]), direction.heave
    if not len(apart):
        return direction
    other = plain_band(apart[:, 0], apart[:, 1], np.zeros(3))
    heave = PlainBand(np.hypot(plate.floor, other.floor), np.hypot(plate.growth, other.growth))
    return replace(direction, heave=heave)


def _banded(direction: Direction, wheels: WheelSet, rows: Sequence[tuple[PlanarForcing, PlanarMotion]]) -> Direction:
    """With bands of heave, tilt and axes that are linear or stay, by what that leaves of the trials."""
    compliance, square, reach = np.linalg.inv(wheels.stiffness(direction.parameters)), [], []
    rows = [(forcing, motion) for forcing, motion in rows if motion.valid.any()]
    for forcing, motion in rows:
        left = motion.x - blocks(np.where(direction.linear, forcing.linear, 0.0))
        square.append((left[motion.valid] ** 2).mean(axis=0))
        reach.append(blocks(reached(forcing.force @ compliance))[motion.valid].mean(axis=0))
    plain = plain_band(np.array(square), np.array(reach), pooled_noise([motion for _, motion in rows]))
    heave = heave_band([motion.tilted for _, motion in rows], [blocks(reached(f.heave)) for f, _ in rows])
    return replace(direction, plain=plain, heave=heave)


def _misplaced(names: Sequence[str], shift: np.ndarray, chi2: np.ndarray) -> Iterator[Verdict]:
    """The wheel that the trials put elsewhere, by shifts (m, 2) [m] and their chi-squares (m,); others like it."""
    far = np.where(elsewhere(shift, chi2), chi2, 0.0)
    if far.any():
        likely = [k for k in np.argsort(-far) if far[k] > _ALIKE * far.max()]
        places = (
            f"{names[k]} stood {1e3 * shift[k][0]:+.0f} mm along x, {1e3 * shift[k][1]:+.0f} mm along y" for k in likely
        )
        message = (
            f"the base turns and slips as if {', or '.join(places)} of its declared place: check the wheels' places in "
            "dataset.json, and the plate's place and axes"
        )
        yield Verdict(STAGE, "warning", message)


def _doubted(directions: Sequence[Direction]) -> Iterator[Verdict]:
    """Axes of which the plate says less than inverse dynamics, which a right plate never does."""
    if doubted := _behind(directions):
        message = f"the plate explains less of {', '.join(doubted)} than inverse dynamics do: check its axes and signs"
        yield Verdict(STAGE, "warning", message)


def _behind(directions: Sequence[Direction]) -> list[str]:
    """Axes of which the plate says less than inverse dynamics, both on trials left out that neither finds wild.

    Where it explains yaw its wheels are those of the model: an axis of one or two trials may be behind by chance.
    """
    if len(directions) < len(SOURCES):
        return []
    calm = _calm(directions)
    plate, dynamics = (d.held_out.only(calm).r2 for d in directions)
    slips = ~np.asarray(directions[0].linear, dtype=bool)
    less = _BY_CHANCE if plate[2] >= EXPLAINED else _LESS
    return [a for a, p, d, s in zip(_AXES, plate, dynamics, slips, strict=True) if s and p < d - less]


def _calm(directions: Sequence[Direction]) -> np.ndarray:
    return ~np.any([d.held_out.wild for d in directions], axis=0)


def _uncorrected(fits: Sequence[Direction], alone: Trials) -> Direction:
    """The plate's direction, its force no correction where trials left out say so.

    Wheels that yield otherwise than by friction under their load, as casters that turn, make the simulated force wrong,
    not the position.
    """
    tried = fit_direction("plate", alone, warmed(alone, fits[1].logarithms))
    calm = ~tried.held_out.wild  # a trial that is wild by the correction alone speaks against it
    left = [np.log(d.held_out.only(calm).variance(np.ones(3, dtype=bool))).mean() for d in (fits[0], tried)]
    return tried if left[1] < left[0] + np.log(BETTER) else fits[0]


def _moved(direction: Direction, names: Sequence[str]) -> Iterator[Verdict]:
    """Trials in which the base was farther from where it was predicted than slip leaves it."""
    tried = direction.held_out
    far = np.sqrt(tried.error / np.maximum(tried.count, 1.0)[:, None])
    for name, (x, y, yaw) in zip(names, far, strict=True):
        if max(x, y) > _FAR or yaw > _TURNED:
            message = (
                f"{name}: base {1e3 * np.hypot(x, y):.0f} mm, {1e3 * yaw:.0f} mrad off its prediction: was it moved?"
            )
            yield Verdict(STAGE, "warning", message)


def _stands(direction: Direction) -> str:
    """What drives hold where trials begin, where that is much."""
    held, sigma = direction.parameters.drive_held, FORCE * float(np.sqrt(direction.covariance[HELD.start, HELD.start]))
    if not direction.slips.any() or abs(held) < max(_MUCH, 3.0 * sigma):
        return ""
    return f"; where trials begin each drive pushes the floor by {held:+.1f} N along x, which front casters hold"


def _judged(direction: Direction, names: Sequence[str]) -> Verdict:
    """What the axes are worth on trials that were left out.

    The others need not show the parameters by which one of them turns the base farther than all others do: how it is
    predicted without it is chance, and says nothing of the prediction with it.
    """
    r2 = np.maximum(direction.held_out.r2, -9.99)
    worth = ", ".join(f"{a} {v:.2f}" for a, v in zip(_AXES, r2, strict=True))
    message = f"from {direction.source}, left-out trials: R2 against a base at rest {worth}"
    if direction.linear.any():
        linear = [a for a, is_linear in zip(_AXES, direction.linear, strict=True) if is_linear]
        message += f"; linear, as the 6x6 compliance has them: {', '.join(linear)}"
    if direction.source == "plate" and not direction.corrected:
        message += "; the plate's force does not correct it: wheels yield otherwise than by friction"
    message += _stands(direction)
    still = [a for a, moves in zip(_AXES, direction.moved | direction.linear, strict=True) if not moves]
    if still:
        message += f"; not moved: {', '.join(still)}"
    if r2[2] >= EXPLAINED or direction.linear[2]:
        return Verdict(STAGE, "ok", message)
    far, others = direction.held_out.farthest(2)
    if others is not None and others.r2[2] >= EXPLAINED:
        alone = f"{names[far]}, which alone turns the base far: record another like it"
        return Verdict(STAGE, "ok", f"{message}; yaw {others.r2[2]:.2f} without {alone}")
    message += "; check the wheels' declared places, the plate's axes and clock, and that nobody moved the base"
    return Verdict(STAGE, "warning", message)
