"""Stage `bundle`: row `full` of the ladder.

1  drive trains from motor and link readings of the calibration trials, beside the geometry found so far
2  geometry again on link angles, static postures and moving trials together, bending of the column taken off
3  the base that sticks and slips, its markers placed by that geometry

Each part is estimated with the others at their estimates.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from calibration.errors import NotEnoughData
from calibration.inference.parameters import Model, Parameter
from calibration.numerics.lie import from_vector
from calibration.numerics.side_by_side import side_by_side
from calibration.numerics.signals import interpolate_columns
from calibration.recording.clock import Clock
from calibration.recording.trial import Trial
from calibration.robot.hand import HandModel
from calibration.robot.laboratory import Laboratory
from calibration.robot.urdf import calibrated_urdf
from calibration.stages.bundle.moved_base import RoughBase, moved_as_predicted
from calibration.stages.bundle.robot import BundleParts
from calibration.stages.drive_trains.column_bending import rigid
from calibration.stages.drive_trains.corrected_trial import CorrectedTrial, corrected_trial
from calibration.stages.drive_trains.drive_train import Quantity
from calibration.stages.drive_trains.drive_trains import DriveTrains
from calibration.stages.drive_trains.errors_in_use import rest_errors, with_doubts
from calibration.stages.drive_trains.from_markers import completed
from calibration.stages.drive_trains.geometry_refit import RefittedGeometry
from calibration.stages.drive_trains.stage import AS_SEEN, Moved, MovedBase, fit_drive_trains, motor_zeros
from calibration.stages.drive_trains.torques import UNWEIGHED, LinkLoads
from calibration.stages.geometry.model_of_fit import hand_of
from calibration.stages.stage import Stage, StageInput, StageResult, has_postures
from calibration.stages.stick_slip.model import StickSlip
from calibration.stages.stick_slip.parameters import covariance_of, wheel_parameters
from calibration.stages.stick_slip.poses import Arm, driven
from calibration.stages.stick_slip.stage import fit_stick_slip
from calibration.stages.stick_slip.standing import SOURCES, Read
from calibration.stages.suspension.base_response import WrenchSources
from calibration.stages.suspension.model import Source, Suspension
from calibration.stages.suspension.weighing import weighed_links
from calibration.verdict import Verdict

STAGE = "bundle"
_ERRS = 2e-4  # [rad] random error of readings, in the geometry, that is worth drive trains from markers alone


@dataclass(frozen=True)
class Bundle:
    """Row `full`.

    Attributes:
        geometry: Fitted to link angles; the geometry found before where there are no drive trains.
        quantities: Of the drive trains and the column.
        parts: What predictions take beside the geometry.
    """

    geometry: Model
    quantities: tuple[Quantity, ...]
    parts: BundleParts

    @property
    def models(self) -> tuple[Model, ...]:
        """Parameters of all parts: `drive_trains`, `stick_slip`, and last the geometry, `full`."""
        return (*self._parts(), self.geometry)

    def _parts(self) -> Iterator[Model]:
        if self.quantities:
            known = [q for q in self.quantities if np.isfinite(q.value) and np.isfinite(q.sigma)]
            own = tuple(Parameter(q.name, q.unit, 0.0, q.value, q.sigma, q.status) for q in known)
            yield Model("drive_trains", own, covariance=np.diag([p.sigma**2 for p in own]))
        if self.parts.stick_slip is not None:
            wheels, first = self.parts.stick_slip.wheels, self.parts.stick_slip.directions[0]
            yield Model("stick_slip", wheel_parameters(wheels, first), covariance=covariance_of(wheels, first))


def fit_bundle(
    lab: Laboratory,
    trials: Sequence[Trial],
    clocks: tuple[Clock, Clock | None],
    geometry: Model,
    suspension: Suspension | None,
) -> tuple[Bundle, tuple[Verdict, ...]]:
    """Row `full` from moving and static trials.

    Args:
        lab: The nominal robot and its setup.
        trials: Calibration trials in which the base is not driven.
        clocks: Of robot and plate, None where there is no plate.
        geometry: The geometry found so far.
        suspension: For heave and tilt; without one the base is not identified.
    """
    (robot, plate), chain, description = clocks, lab.chain, lab.description
    hand = hand_of(geometry, chain, lab.nominal_frames)
    sources = WrenchSources(_placed(lab, hand), robot, plate, from_vector(hand.base))
    weighed, unlikely = weighed_links(sources, trials, None if suspension is None else suspension.K, motor_zeros(hand))
    links, masses = (None, UNWEIGHED) if weighed is None else (weighed.links, weighed.covariance)
    if links is not None:
        lab = replace(lab, urdf=links.on(lab.urdf))
        sources = replace(sources, lab=_placed(lab, hand))
    rough = RoughBase(AS_SEEN) if suspension is None else moved_as_predicted(sources, trials, suspension)
    trains, findings, loads = fit_drive_trains(sources.lab.urdf, description, trials, robot, hand, rough.moved, masses)
    bending, quantities, geometry = rigid(chain.joints[0]), trains.parameters, replace(geometry, name="full")
    refitted, more = _completed(lab, trials, robot, geometry, trains, loads, findings, rough.moved)
    found = [*unlikely, *findings, *more]
    if refitted is not None:
        geometry, bending, trains = refitted.model, refitted.bending, refitted.trains
        hand = refitted.hand(chain)
        trains = trains.built(_placed(lab, hand).urdf, bending.column)
        found += [Verdict(STAGE, "warning", message) for message in refitted.shown]
        link = next(body.link for body in description.bodies if body.name == description.base_body.name)
        quantities = (*trains.parameters, *bending.parameters(_carried_link(lab, link), _moment_sigma(lab)))
    base, read = None, list[Read]()
    if suspension is not None:
        sources = replace(sources, lab=_placed(lab, hand), T_base_B=from_vector(hand.base))
        base, read, more = fit_stick_slip(sources, trials, suspension, Arm(trains, rough.moved), rough.logarithms)
        found += more
    at_rest = other = np.zeros(0)
    if refitted is not None:
        trains, at_rest, other = _in_use(base, sources, trials, read, trains, hand, rough.moved)
    parts = BundleParts(trains.trains, motor_zeros(hand), bending, base, at_rest, other, trains.hung, links, True)
    return Bundle(geometry, quantities, parts), tuple(replace(v, stage=STAGE) for v in found)


def _placed(lab: Laboratory, hand: HandModel) -> Laboratory:
    """The robot with its joints where the geometry has them."""
    return replace(lab, urdf=calibrated_urdf(lab.urdf, hand.chain))


def _in_use(  # noqa: PLR0913
    base: StickSlip | None, sources: WrenchSources, trials: Sequence[Trial], read: Sequence[Read], trains: DriveTrains,
    hand: HandModel, moved: Moved,
) -> tuple[DriveTrains, np.ndarray, np.ndarray]:  # fmt: skip
    """The drive trains with what predictions left; s_j (m,) at rest, and where inverse dynamics move the base.

    The last is empty where no plate moves the base better. `moved` is for trials that are not `read`, or have no base.
    """
    robot, known = sources.robot, () if base is None else tuple(d.source for d in base.directions)
    if robot is None:
        return trains, np.zeros(0), np.zeros(0)

    def corrected(by: Source | None, trials: Sequence[Trial]) -> list[CorrectedTrial]:
        ids = {trial.id for trial in trials}
        own = [one for one in read if one.trial.id in ids]
        bases = moved if base is None or by is None else {**moved, **_moved_by(base, sources, own, trains, by)}
        return side_by_side(lambda t: corrected_trial(trains, t, robot, hand, bases.get(t.id)), trials)

    shown = corrected(known[0] if known else None, trials)
    resting = [trial for trial in trials if len(trial.dwell_start)]
    other = corrected("dynamics", resting) if len(known) == len(SOURCES) else None
    by_dynamics = np.zeros(0) if other is None else rest_errors(trains, other, robot)
    return with_doubts(trains, shown), rest_errors(trains, shown, robot), by_dynamics


def _moved_by(
    base: StickSlip, sources: WrenchSources, read: Sequence[Read], trains: DriveTrains, source: Source
) -> Moved:
    """How a wrench moves the base in the trials that have it."""

    def moved(one: Read) -> MovedBase | None:
        with suppress(NotEnoughData):
            forcing = driven(base, sources, one, source, trains)
            x = interpolate_columns(one.trial.t_mocap, forcing.t, base.displacement(forcing)[0])
            return MovedBase(one.rest.poses(x), source == "plate")
        return None

    found = side_by_side(moved, read)
    return {one.trial.id: was for one, was in zip(read, found, strict=True) if was is not None}


def _completed(  # noqa: PLR0913
    lab: Laboratory,
    trials: Sequence[Trial],
    robot: Clock,
    geometry: Model,
    trains: DriveTrains,
    loads: Mapping[str, LinkLoads],
    findings: Sequence[Verdict],
    moved: Moved,
) -> tuple[RefittedGeometry | None, tuple[Verdict, ...]]:
    """`completed`; nothing where link readings were rejected, no joint has a drive train or no reading errs."""
    errs = bool((geometry.reading_sigma > _ERRS).any())
    if any(v.verdict == "refused" for v in findings) or not (trains.trains or errs):
        return None, ()
    hand = hand_of(geometry, lab.chain, lab.nominal_frames)
    try:
        return completed(lab.chain, trials, robot, hand, trains, loads, moved)
    except NotEnoughData as error:
        return None, (Verdict(STAGE, "missing", str(error)),)


def _moment_sigma(lab: Laboratory) -> float:
    """Share [-] by which a moment of what the first joint carries may be off, its links' masses being independent."""
    robot = lab.chain.nominal
    masses = np.array([body.mass for body in robot.inertias[robot.getJointId(lab.chain.joints[0]) + 1 :]])
    return lab.description.tolerances.link_mass * float(np.linalg.norm(masses) / masses.sum())


def _carried_link(lab: Laboratory, base_link: str) -> str:
    """Link of the marker body that the column carries; the base's where there is none."""
    known = (lab.description.base_body.name, lab.description.hand_body.name)
    return next((body.link for body in lab.description.bodies if body.name not in known), base_link)


def _run(data: StageInput) -> StageResult:
    geometry, robot = data.model("full") or data.model("model_2"), data.clock("robot")
    if data.rejected or geometry is None:
        return StageResult()
    if robot is None:
        raise NotEnoughData("no robot clock")
    suspension = data.quantity(Suspension)
    found, findings = fit_bundle(data.lab, data.trials, (robot, data.clock("plate")), geometry, suspension)
    return StageResult(found.models, findings, found)


def _lacks(data: StageInput) -> str:
    if not data.trials:
        return "posture means show no motion; record motor and link readings continuously"
    return has_postures(data) or ("" if data.clock("robot") else "no readings on a known clock")


BUNDLE = Stage(STAGE, _run, _lacks, needs="geometry")
