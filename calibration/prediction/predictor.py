"""Held-out prediction of the hand pose by every model of an estimate.

    T_lab_hand(t) = T_lab_B(t)  T_B_H(q(t))

T_lab_B, where the base's marker body is:      fixed      as in the first second
                                               plate      moved by the suspension under the plate's wrench
                                               dynamics   moved by the suspension under the nominal inverse dynamics
                                               measured   by its markers throughout
q, readings the geometry is evaluated at:      motor      q_motor by the robot's clock; less the joint model in model_3
                                               link       link readings, their zero laid on the motor's
Row `full` has link angles behind its drive trains, the column bent, and the base that sticks and slips in place of the
suspension, where those were identified.

The base's motion from the same source loads the drive trains, predicted where it is `measured`. Of a trial nothing else
is read: encoders, plate, wrist, base markers of its first second (throughout for `measured`), never hand or shoulder.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from calibration.estimate.rows import LADDER, NOMINAL, SOURCES, Base, Encoder, LadderRow, row_of
from calibration.mocap.cluster_pose import poses_of_means
from calibration.mocap.postures import dwell_windows, readings_at
from calibration.numerics.lie import from_vector, inverse
from calibration.prediction.base_pose import BaseInTrial, measured_base
from calibration.prediction.bundled_arm import BundledArm
from calibration.prediction.predicted_trial import Delivered, PredictedTrial, Prediction, base_motion, joint_samples
from calibration.prediction.row_readings import RowReadings, Side
from calibration.recording.clock import Clock
from calibration.recording.posture_means import PostureMeans
from calibration.recording.schema import Description, TrialEntry
from calibration.recording.trial import Trial
from calibration.robot.hand import HandModel
from calibration.stages.bundle.robot import BundledRobot
from calibration.stages.drive_trains.corrected_trial import CorrectedTrial
from calibration.stages.drive_trains.stage import MovedBase
from calibration.stages.joints.correction import Corrected, JointModels
from calibration.stages.stick_slip.poses import BasePrediction
from calibration.stages.suspension.base_response import laboratory
from calibration.stages.suspension.model import Source, Suspension
from calibration.stages.suspension.rest_frame import Rest

T = TypeVar("T")
_SLIPS: tuple[Source, ...] = ("plate", "dynamics")


@dataclass(frozen=True)
class Predictor:
    """All that predicting the trials of one dataset takes.

    Attributes:
        models: Robots by row.
        urdf: Nominal robot.
        description: Of the dataset.
        robot: Clock of the encoders, None where there is no continuous recording.
        plate: Clock of the plate, None where there is none.
        suspension: None where there is none.
        joints: None where there is none.
        bundled: Robot of the row with drive trains and a stick-slip base; None where there is none.
        main: Row that is delivered; empty where there is none.
    """

    models: dict[str, HandModel]
    urdf: str
    description: Description
    robot: Clock | None
    plate: Clock | None = None
    suspension: Suspension | None = None
    joints: JointModels | None = None
    bundled: BundledRobot | None = None
    main: str = ""

    def __call__(self, entry: TrialEntry, trial: Trial, poses: "TrialPoses | None" = None) -> PredictedTrial:
        """Predictions of one trial by every model, every source of the base's motion and every encoder it has."""
        poses = poses or self.poses(entry, trial)
        rows = tuple(
            Prediction(
                row.name,
                source,
                encoder,
                entry.id,
                entry.kind,
                trial.t_mocap,
                T @ poses.in_base(row, encoder, source),
                poses.base_variance(row, source),
            )
            for row, _, encoder in self._rows()
            for source in row.bases
            if (T := poses.base(row, source)) is not None
        )
        motion = None
        if poses.loaded is not None and NOMINAL in self.models:
            found = [(source, poses.displaced(source, NOMINAL)) for source, _ in poses.loaded.suspension.held_out]
            slipped = [(source, poses.slipped(source)) for source, _ in poses.loaded.suspension.held_out]
            motion = base_motion(poses.T_lab_B, found, tuple((s, one) for s, one in slipped if one is not None))
        moves = entry.kind != "static"
        geared = poses.geared() if moves else None
        samples = tuple(joint_samples(self.joints, self.bundled, trial, geared)) if moves else ()
        frictions = () if geared is None or self.bundled is None else self.bundled.trains.frictions(geared.loads)
        delivered = poses.delivered() if moves else None
        dwells = dwell_windows(trial)
        own = entry.id, entry.kind, trial.t_mocap
        return PredictedTrial(*own, rows, motion, samples, poses.T_lab_B, dwells, poses.corrected, delivered, frictions)

    def poses(self, entry: TrialEntry, trial: Trial) -> "TrialPoses":
        """What the rows of one trial are made of."""
        T_lab_B, start = measured_base(self.description.base_body, trial)
        still, corrected = np.broadcast_to(start, T_lab_B.shape), self.row_readings.corrected(trial)
        return TrialPoses(self, entry, trial, T_lab_B, still, self._base(entry, trial, start), corrected)

    def of_means(self, entry: TrialEntry, means: PostureMeans) -> Iterator[Prediction]:
        """Predictions of posture means, one a posture in `t`: the base measured or its markers' own frame, motor side.

        Means show no motion before a posture: drive trains are taken to be at rest.
        """
        T_lab_B = poses_of_means(self.description.base_body, means).T
        for row, hand, encoder in self._rows():
            if encoder == "motor" and row.means:
                T = T_lab_B @ self._at_rest(row, hand, means.q_motor)
                yield Prediction(row.name, "measured", "motor", entry.id, entry.kind, np.arange(float(len(means))), T)

    def _at_rest(self, row: LadderRow, hand: HandModel, q: np.ndarray) -> np.ndarray:
        """T_B_H (n, 4, 4) at motor readings (n, n_joints), each at rest for itself."""
        if self.row_readings.side(row, "motor") != "bundled" or self.bundled is None:
            return hand.poses(q)
        arm = BundledArm(self.bundled.trains, self.bundled.bending, self.bundled.at_rest)
        return arm.poses(hand, arm.at_rest(q))

    def _rows(self) -> Iterator[tuple[LadderRow, HandModel, Encoder]]:
        ours = [row for row in LADDER if row.name in self.models]
        theirs = [row_of(name) for name in self.models if all(name != row.name for row in LADDER)]
        for row in (*ours, *theirs):
            for encoder in row.encoders:
                if encoder == "motor" or not row.bundle or (self.bundled and self.bundled.knows_link_encoders):
                    yield row, self.models[row.name], encoder

    @cached_property
    def row_readings(self) -> RowReadings:
        """What the geometry of each row is evaluated at."""
        return RowReadings(self.robot, self.joints, self.bundled)

    def _base(self, entry: TrialEntry, trial: Trial, T_lab_B: np.ndarray) -> BaseInTrial | None:
        """The base on its suspension, its marker body at rest at T_lab_B (4, 4)."""
        if self.suspension is None:
            return None
        lab = laboratory(self.urdf, self.description.carrying(entry.payload), self.robot, self.plate)
        return BaseInTrial(self.suspension, lab, trial, T_lab_B)


@dataclass(frozen=True, eq=False)
class TrialPoses:
    """Poses in one trial, each computed once.

    Attributes:
        predictor: All that predicting takes.
        entry: The trial's declaration.
        trial: Its recording.
        T_lab_B: (n, 4, 4) the base's marker body as measured.
        still: (n, 4, 4) as in the first second.
        loaded: The base on its suspension; None without one.
        corrected: Readings corrected by the joint models; None without.
    """

    predictor: Predictor
    entry: TrialEntry
    trial: Trial
    T_lab_B: np.ndarray
    still: np.ndarray
    loaded: BaseInTrial | None
    corrected: Corrected | None
    _known: dict[tuple[object, ...], Any] = field(default_factory=dict)

    def in_base(self, row: LadderRow, encoder: Encoder, source: Base) -> np.ndarray:
        """T_B_H (n, 4, 4) of a row, NaN where a reading is missing; `source` of the base's motion, which loads it."""
        p, side = self.predictor, self.predictor.row_readings.side(row, encoder)
        hand, geared = p.models[row.name], self.geared(source) if side in ("bundled", "bundled link") else None
        return self._once(("in base", id(hand), side, id(geared)), lambda: self._in_base(hand, side, geared))

    def base(self, row: LadderRow, source: Base) -> np.ndarray | None:
        """T_lab_B (n, 4, 4) of a row by a source of the base's motion; None where that was not recorded."""
        if source == "measured" or source == "fixed":
            return self.T_lab_B if source == "measured" else self.still
        if source == "submitted":  # poses of another program, not predicted here
            return None
        if row.bundle and (slipped := self.slipped(source)) is not None:
            return slipped.T_lab_B
        found = self.displaced(source, row.name)
        return None if found is None else found[0].poses(found[1])

    def geared(self, source: Base | None = None) -> CorrectedTrial | None:
        """Link angles behind the drive trains, the base moved by a source, by the best where none is named.

        A base that slips is predicted where it is measured, too: markers do not show how it accelerates. None where no
        drive train was identified.
        """
        bundled, robot = self.predictor.bundled, self.predictor.robot
        if bundled is None or robot is None or not bundled.trains.trains or not len(self.trial.t_robot):
            return None
        row = next(row for row in LADDER if row.bundle)
        slips = [s for s in _SLIPS if source == "measured" and self.slipped(s) is not None]
        tried = ((s, self.base(row, s)) for s in (*slips, *((source,) if source else SOURCES)))
        chosen, moved = next((s, MovedBase(T_lab_B, s == "plate")) for s, T_lab_B in tried if T_lab_B is not None)
        return self._once(("geared", chosen), lambda: bundled.corrected(self.trial, robot, moved))

    def prepare(self, source: Base) -> None:
        """Compute what many rows share under a source of the base's motion."""
        rows = [row for row in LADDER if row.bundle and row.name in self.predictor.models]
        if any(self.base(row, source) is not None for row in rows):
            self.geared(source)

    def base_variance(self, row: LadderRow, source: Base) -> np.ndarray | None:
        """Variances (6,) or (n, 6) of its displacement in frame 0 [m2, rad2]; None where it is not predicted."""
        if self.loaded is None or source not in SOURCES:
            return None
        known = dict(self.loaded.suspension.held_out)
        tried = next(iter(known.values()))
        if source != "plate" and source != "dynamics":
            return tried.still
        if row.bundle and (slipped := self.slipped(source)) is not None:
            return slipped.motion.variance
        tried = known.get(source, tried)
        return tried.variance(tried.moves)

    def delivered(self) -> Delivered | None:
        """Parts of the row that is delivered; None where it has no prediction of this trial."""
        p, row = self.predictor, row_of(self.predictor.main)
        sources = (source for source in SOURCES if source in row.bases and row.name in p.models)
        found = ((source, T) for source in sources if (T := self.base(row, source)) is not None)
        source, T_lab_B = next(found, (None, None))
        if source is None or T_lab_B is None:
            return None
        side, hand = p.row_readings.side(row, "motor"), p.models[row.name].carrying(self.entry.payload)
        T_B_H, columns = self.in_base(row, "motor", source), hand.chain.columns
        q, motor = self._readings(side), self._readings("motor")
        link = readings_at(self.trial, p.robot, self.trial.t_mocap, self.trial.q_link) if p.robot else motor
        known = np.isfinite(q).all(axis=1) & np.isfinite(motor).all(axis=1)
        J, rigid, bare = (np.full((len(q), *shape), np.nan) for shape in ((3, len(columns)), (4, 4), (4, 4)))
        rigid[known], bare[known] = hand.poses(q[known]), hand.poses(motor[known])
        R = T_lab_B[known, :3, :3] @ T_B_H[known, :3, :3]
        J[known] = R @ hand.joint_jacobians(q[known])[:, :3]
        off = [("base", self.still @ T_B_H)]
        if side == "bundled":
            off += [("drive trains", T_lab_B @ (T_B_H @ inverse(rigid)) @ bare), ("bending", T_lab_B @ rigid)]
        return Delivered(hand.chain.joints, T_lab_B, T_B_H, q[:, columns], link[:, columns], J, tuple(off))

    def displaced(self, source: Source, model: str) -> tuple[Rest, np.ndarray] | None:
        """Rest and displacement (n, 6) of the base by its suspension; None where the source was not recorded."""
        hand = self.predictor.models[model]
        return self._once(("displaced", source, id(hand)), lambda: self._displaced(source, hand))

    def _in_base(self, hand: HandModel, side: Side, geared: CorrectedTrial | None) -> np.ndarray:
        p = self.predictor
        if geared is not None and p.bundled is not None and p.robot is not None:
            return p.bundled.hand_poses(geared, p.robot, "motor" if side == "bundled" else "link")
        q = self._readings(side)
        T, known = np.full((len(q), 4, 4), np.nan), np.isfinite(q).all(axis=1)
        T[known] = hand.carrying(self.entry.payload).poses(q[known])
        return T

    def _readings(self, side: Side) -> np.ndarray:
        """Readings (n, n_joints) [rad, m] of a side of the gears at the motion capture's times."""
        corrected = None if self.corrected is None else self.corrected.q
        geared = self.geared() if side == "bundled" else None
        return self.predictor.row_readings.of(side, self.trial, corrected if geared is None else geared.trial.q_motor)

    def _displaced(self, source: Source, hand: HandModel) -> tuple[Rest, np.ndarray] | None:
        if self.loaded is None or not self._recorded(source):
            return None
        rest = self.loaded.rest(from_vector(hand.base))
        return rest, self.loaded.displacement(source, rest)

    def slipped(self, source: Source) -> BasePrediction | None:
        """The base that sticks and slips; None where none was identified from that source."""
        return self._once(("slipped", source), lambda: self._slipped(source))

    def _slipped(self, source: Source) -> BasePrediction | None:
        bundled = self.predictor.bundled
        if self.loaded is None or bundled is None or not bundled.knows(source) or not self._recorded(source):
            return None
        sources = replace(self.loaded.wrenches, T_base_B=from_vector(bundled.hand.base))
        return bundled.base_motion(sources, self.trial, source)

    def _recorded(self, source: Source) -> bool:
        return source != "plate" or (self.predictor.plate is not None and len(self.trial.t_plate) > 0)

    def _once(self, key: tuple[object, ...], compute: Callable[[], T]) -> T:
        if key not in self._known:
            self._known[key] = compute()
        return self._known[key]
