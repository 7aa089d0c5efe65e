"""The estimate in use: readings in, hand pose and its uncertainty out.

    T_lab_hand = T_lab_base(t) T_base_tool(q - offset) T_tool_H

T_lab_base    as at the start; with a wrench, moved by the suspension from there           see loaded_base
q             q_motor; with velocities, less the joint models' discrepancy                 see joint_model
covariance    of the local twist:   J Sigma J' + J_joint diag(sigma^2) J_joint' + Ad diag(v) Ad'

Sigma is that of the parameters by random errors: what the model leaves out moves parameters and predictions together,
and what it leaves of a prediction is in sigma, a joint's random reading error at rest or, where its model is used, that
of the flank and of left-out trials; v what the suspension left of trials it had not seen, for a pose in the lab.
The geometry is that of the main model. Where that is `full` with drive trains, q are link angles and sigma theirs, the
column bends, and the base sticks and slips (`bundled_arm`, `slipping_base`).
"""

from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np

from calibration.checks.joint_readings import implausible_readings
from calibration.errors import InputError, NotCalibrated, NotEnoughData, ShapeError
from calibration.estimate.estimate import Estimate
from calibration.estimate.files import load_estimate
from calibration.estimate.rows import LADDER, row_of
from calibration.numerics.lie import from_vector, inverse
from calibration.prediction.base_pose import LoadedBase, base_at, loaded_base
from calibration.prediction.bundled_arm import ArmPositions, BundledArm
from calibration.prediction.hand_pose import (
    HandPose,
    RobotState,
    at_readings,
    continuous,
    in_lab,
    needed,
    placed,
    uncertain,
)
from calibration.prediction.slipping_base import SlippingBase
from calibration.recording.clock import Clock
from calibration.recording.schema import Description
from calibration.robot.chain import chain_of_frames
from calibration.robot.hand import HandModel
from calibration.robot.hand_uncertainty import Predicted, Session, Spread, points_of
from calibration.robot.kinematics import beyond
from calibration.robot.laboratory import Laboratory
from calibration.stages.bundle.robot import BundledRobot
from calibration.stages.geometry.model_of_fit import hand_of
from calibration.stages.joints.correction import JointModels, correct, input_model, velocities
from calibration.stages.suspension.model import Source, Suspension


@dataclass(frozen=True)
class Compensator:
    """The main model of an estimate, with what corrects its readings and moves its base.

    Attributes:
        hand: The calibrated robot.
        names: Parameters that are not certain, length p.
        covariance: (p, p) of them.
        reading_sigma: (k,) random reading error of each joint [rad, m].
        hand_error: (2,) random errors of the hand's position [m] and rotation [rad]; (1,) of the position, (0,) none.
        joints: Joint models, None where the estimate has none.
        suspension: None where the estimate has none.
        laboratory: Where it was found, None where the estimate does not say.
        arm: Drive trains and column of row `full`; None of another row.
        slipping: Its base; None where the suspension alone moves it.
        clocks: Of robot and plate on the motion capture's, in the session it was calibrated in.
    """

    hand: HandModel
    names: tuple[str, ...]
    covariance: np.ndarray
    reading_sigma: np.ndarray
    hand_error: np.ndarray = field(default_factory=lambda: np.zeros(0))
    joints: JointModels | None = None
    suspension: Suspension | None = None
    laboratory: Description | None = None
    arm: BundledArm | None = None
    slipping: SlippingBase | None = None
    clocks: tuple[Clock, ...] = ()
    _bases: dict[bytes, LoadedBase] = field(default_factory=dict, init=False, repr=False, compare=False)

    @property
    def spread(self) -> Spread:
        """What it is not sure of."""
        return Spread(self.names, self.covariance, self.reading_sigma, self.hand_error)

    @classmethod
    def load(cls, folder: Path | str, payload: float | None = None) -> "Compensator":
        """Read the folder of an estimate; `payload` [kg] is in the hand where it is not the declared one.

        Raises:
            InputError: The folder is not a saved estimate.
            NotCalibrated: The estimate must not be used.
        """
        estimate = load_estimate(folder)
        estimate.require_calibrated()
        if estimate.urdf is None or estimate.robot is None:
            raise InputError(folder, "not a whole estimate: nominal.urdf or the robot's joints and frames are missing")
        return cls.of(estimate, payload)

    @classmethod
    def of(cls, estimate: Estimate, payload: float | None = None) -> "Compensator":
        """The main model of an estimate that knows its robot."""
        if estimate.urdf is None or estimate.robot is None:
            raise NotCalibrated(["it does not name its robot"])
        robot, laboratory = estimate.robot, estimate.laboratory
        frames = robot.base_frame, robot.tool_frame
        described = () if laboratory is None else (laboratory.payload, laboratory.gravity)
        chain = chain_of_frames(estimate.urdf, robot.joints, *frames, *described).carrying(payload)
        model = estimate.model(estimate.main)
        hand = hand_of(model, chain, np.zeros(12))
        play = model.reading_sigma if len(model.reading_sigma) else np.zeros(len(chain.joints))
        joints = None
        corrected = any(row.joints and row.geometry == estimate.main for row in LADDER)
        if corrected and estimate.joint_models and laboratory is not None:
            inputs = input_model(Laboratory(estimate.urdf, laboratory.carrying(payload)), hand)
            joints = JointModels(inputs, np.array(estimate.link_zero), estimate.joint_models)
        found = cls(hand, *uncertain(hand, model), play, model.hand_error, joints, estimate.suspension, laboratory)
        return replace(found, clocks=estimate.clocks)._bundled(estimate, payload)

    def _bundled(self, estimate: Estimate, payload: float | None) -> "Compensator":
        """With drive trains and base of row `full`, where it is the main one and has them."""
        parts, laboratory, urdf = estimate.bundle, self.laboratory, str(estimate.urdf)
        if parts is None or laboratory is None or not parts.trains or not row_of(estimate.main).bundle:
            return self
        robot = BundledRobot.of(self.hand, parts, urdf, laboratory)
        trains, slipping = robot.trains.carrying(payload), None
        arm = BundledArm(trains, robot.bending, robot.at_rest)
        if robot.stick_slip is not None:
            source: Source = "plate" if robot.knows("plate") else "dynamics"
            lab = Laboratory(trains.urdf, laboratory.carrying(payload))
            slipping = SlippingBase(robot.stick_slip, lab, source, trains)
        return replace(self, joints=None, arm=arm, slipping=slipping)

    def predict(  # noqa: PLR0913  what the instruments show
        self,
        t: np.ndarray,
        q_motor: np.ndarray,
        wrench: np.ndarray | None = None,
        T_lab_base_start: np.ndarray | None = None,
        velocity: np.ndarray | None = None,
        t_wrench: np.ndarray | None = None,
        wrist: np.ndarray | None = None,
    ) -> HandPose:
        """Hand poses at readings q_motor (n, n_joints) [rad, m], taken at t (n,) [s].

        Args:
            t: Times; from a second of readings at 20 Hz or more the joints have velocities. With drive trains, readings
                without are each taken to be at rest.
            q_motor: Readings, columns as in the estimate.
            wrench: (n, 6) action on the plate [N, N.m, lab axes, about the plate's centre], the first second at rest;
                where the base's pose is not given, in the base's axes about its origin. Without a plate in the
                laboratory, inverse dynamics of continuous readings move the base of row `full`.
            T_lab_base_start: (4, 4) pose of the base frame at the start; identity where not given.
            velocity: (n, n_joints) of the motor side [rad/s, m/s], where it is known.
            t_wrench: Times (m,) [s, plate's clock] of a wrench (m, 6) that was not taken at t, then the robot's clock.
            wrist: (n, 6) of the wrist's sensor at t: push and payload load joints and base, a moving hand the base; it
                shows what friction holds under a load that the calibration did not have.

        Raises:
            NotEnoughData: A wrench without a suspension or for less than a second, or without its clock.
            InputError: Readings are far outside the joints' limits, as degrees are.
        """
        t, q = np.asarray(t, dtype=float), np.asarray(q_motor, dtype=float)
        if q.ndim != 2 or len(t) != len(q):
            raise ShapeError("q_motor", q.shape, (len(t), "n_joints"))
        self._refuse_impossible(q)
        base, moved, spread = self._base(T_lab_base_start), None, None
        if wrench is not None:
            w, there = np.asarray(wrench, dtype=float), needed(base)
            if t_wrench is not None:
                w = at_readings(t, self.clocks, np.asarray(t_wrench, dtype=float), w)
            if self.slipping is None or self.slipping.source != "plate":
                moved = there.moved(t, w)
            else:
                moved, spread = self.slipping.moved(there, t, q, w, wrist)
        elif base is not None and self.slipping is not None and self.slipping.source != "plate" and continuous(t):
            moved, spread = self.slipping.moved(base, t, q, None, wrist)
        known = velocity is not None or continuous(t)
        T = placed(T_lab_base_start, moved, len(t))
        if self.arm is not None:
            along = partial(self.arm.along, t, q, velocity, T, wrist, wrench is not None)
            found = self._on_links(along() if known else self.arm.at_rest(q, T_lab_base_start))
        else:
            found = self._hand(t, q, velocities(t, q) if known and velocity is None else velocity)
        return in_lab(found, base, T, moved is not None, None if spread is None else partial(np.asarray, spread))

    def base_from_markers(self, markers: np.ndarray) -> np.ndarray:
        """T_lab_base (4, 4) of the estimated base frame, for `predict`, from its markers at rest.

        Args:
            markers: (n, m, 3) [m, lab] in the order of dataset.json, NaN where not seen.

        Raises:
            NotEnoughData: The estimate knows no three markers on the base, or no sample shows three.
        """
        return base_at(None if self.laboratory is None else self.laboratory.base_body, self.hand.base, markers)

    def tool(self, pose: HandPose) -> np.ndarray:
        """Poses (n, 4, 4) of the URDF's tool frame, where `pose.T` is that of the hand's marker body."""
        return np.asarray(pose.T @ inverse(from_vector(self.hand.hand)))

    def points(self, markers: np.ndarray, q_motor: np.ndarray, session: Session | None = None) -> Predicted:
        """Markers (m, 3) [m] of the hand's body, as the base's marker body sees them, with their band.

        Args:
            markers: As `bodies` of dataset.json has them.
            q_motor: (n, n_joints) readings at rest [rad, m], each for itself.
            session: Another day: base and marker body are not quite where they were; `Session()` for what is usual.
        """
        q = np.asarray(q_motor, dtype=float)
        found = self._hand(np.zeros(len(q)), q, None) if self.arm is None else self._on_links(self.arm.at_rest(q))
        T = inverse(from_vector(self.hand.base)) @ found.T
        return points_of(T, found.covariance, np.asarray(markers, dtype=float), session)

    def step(
        self,
        t: float,
        q_motor: np.ndarray,
        wrench: np.ndarray | None = None,
        T_lab_base_start: np.ndarray | None = None,
        velocity: np.ndarray | None = None,
        before: RobotState | None = None,
    ) -> HandPose:
        """The same for one sample q_motor (n_joints,) and nothing after it; arrays of length 1.

        `predict` looks half a second ahead for velocities and for a wrench below 10 Hz. Here the caller's velocity
        (n_joints,) is used as it is, and none leaves the readings as they are, or the torques of drive trains as those
        of rest; the wrench (6,) is used as it comes. Drive trains and base are carried on from `before`, the `state`
        of the pose one step earlier; the first second is the rest.

        Raises:
            NotEnoughData: A wrench without a suspension.
        """
        q, base = np.asarray(q_motor, dtype=float)[None], self._base(T_lab_base_start)
        v = None if velocity is None else np.asarray(velocity, dtype=float)[None]
        self._refuse_impossible(q)
        before, moving, state, variance, arm, in_base = before or RobotState(), None, None, None, None, None
        if self.arm is not None:
            moving = self.arm.moving(t, q[0], None if v is None else v[0], before.arm)
        if wrench is not None:
            w, there = np.asarray(wrench, dtype=float), needed(base)
            if self.slipping is None or self.slipping.source != "plate":
                state = there.stepped(t, w, before.base)
            else:
                state = self.slipping.stepped(there, t, w, None if v is None else moving, before.base)
                variance = partial(self.slipping.variance, state)
        moved, a = (None, None) if state is None else (state.moved, state.moves)
        T = placed(T_lab_base_start, moved, 1)
        if self.arm is not None and moving is not None:
            arm = self.arm.stepped(t, moving, before.arm, self.arm.root(None if T is None else T[0], a))
            in_base = self._on_links(arm.positions)
        in_base = in_base or self._hand(np.array([t]), q, v)
        return in_lab(in_base, base, T, moved is not None, variance, RobotState(arm, state))

    def _refuse_impossible(self, q: np.ndarray) -> None:
        if beyond(q, *self.hand.nominal.limits) and (wrong := list(implausible_readings(self.hand.nominal, q))):
            raise InputError("q_motor", "; ".join(wrong))

    def _base(self, T_lab_base: np.ndarray | None) -> LoadedBase | None:
        """The base at its pose, None without a suspension or a laboratory."""
        if self.suspension is None or self.laboratory is None:
            return None
        key = b"" if T_lab_base is None else np.asarray(T_lab_base, dtype=float).tobytes()
        if key not in self._bases:
            self._bases.clear()
            self._bases[key] = loaded_base(self.suspension, self.laboratory, T_lab_base)
        return self._bases[key]

    def _hand(self, t: np.ndarray, q: np.ndarray, velocity: np.ndarray | None) -> HandPose:
        """In the base frame, by readings less the joint models."""
        variance = np.broadcast_to(self.reading_sigma**2, (len(q), len(self.reading_sigma)))
        if velocity is not None and self.joints is not None:
            corrected = correct(self.joints, t, q, velocity)
            q, columns = corrected.q, self.hand.chain.columns
            variance = np.where(corrected.modelled[columns], corrected.variance[:, columns], variance)
        return HandPose(self.hand.in_base_frame(q), lambda: self._covariance(q, variance))

    def _on_links(self, positions: ArmPositions) -> HandPose:
        """In the base frame, by link angles and with the column bent."""
        if self.arm is None:
            raise NotEnoughData("this estimate has no drive trains")
        arm, T = self.arm, self.hand.in_base_frame(positions.q, self.arm.bending.turns(positions.moment))

        def covariance() -> np.ndarray:
            variance = arm.variance(self.hand, positions, self.reading_sigma)
            return self._covariance(positions.q, variance) + arm.column_covariance(self.hand, positions, T)

        return HandPose(T, covariance)

    def _covariance(self, q: np.ndarray, variance: np.ndarray) -> np.ndarray:
        """(n, 6, 6) by parameters and by positions q of variance (n, k)."""
        found = self.hand.poses_and_derivatives(q, names=self.names)
        covariance = found.J @ self.covariance @ np.swapaxes(found.J, 1, 2)
        covariance += (found.J_joint * variance[:, None, :]) @ np.swapaxes(found.J_joint, 1, 2)
        return np.asarray(covariance + np.diag(self.spread.hand_variances))
