"""What is predicted of one trial: the hand by every row, and the base and the readings that the rows are products of.

predictions/<trial>.nc     t                                       [s, mocap clock]
                           rows/<model>/<base>/<encoder>           position [m, lab], quaternion_wxyz of the hand
                           base                                    displacement [m, rad, frame 0]: measured, by source
                           base/slipping                           x, variance, moment [N.m], use of friction by wheel
                           joints/<joint>                          theta, velocity, discrepancy, predicted, train, low,
                                                                   high [rad, rad/s]
"""

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from calibration.estimate.rows import Base, Encoder
from calibration.recording import netcdf
from calibration.recording.trial import Trial
from calibration.stages.bundle.robot import BundledRobot
from calibration.stages.drive_trains.corrected_trial import CorrectedTrial
from calibration.stages.joints.correction import Corrected, JointModels
from calibration.stages.joints.samples import samples_of
from calibration.stages.stick_slip.poses import BasePrediction, SlippingMotion
from calibration.stages.suspension.model import Source
from calibration.stages.suspension.rest_frame import Rest


@dataclass(frozen=True)
class Delivered:
    """Parts of n predicted poses, k joints of the chain.

    Attributes:
        joints: Their names.
        T_lab_B: (n, 4, 4) the base's marker body.
        T_B_H: (n, 4, 4) the hand in it.
        q: (n, k) joint positions the geometry is evaluated at [rad, m].
        q_link: (n, k) link encoders; NaN where there is none.
        J: (n, 3, k) displacement of the hand by q [m/rad, lab axes].
        without: T_lab_H (n, 4, 4) with one effect switched off, by its name.
    """

    joints: tuple[str, ...]
    T_lab_B: np.ndarray
    T_B_H: np.ndarray
    q: np.ndarray
    q_link: np.ndarray
    J: np.ndarray
    without: tuple[tuple[str, np.ndarray], ...]


_OPEN = "make it again with evaluate"


@dataclass(frozen=True)
class Prediction:
    """Predicted hand poses of one trial.

    Attributes:
        model: Row of the ladder.
        base: Where the base's motion comes from.
        encoder: Which side of the gear was read.
        trial_id: The trial.
        kind: Its kind: static, sweep, swing, spin, drive.
        t: (n,) [s, mocap clock].
        T_lab_hand: (n, 4, 4), NaN where it cannot be predicted.
        base_variance: (6,) or (n, 6) of the base's displacement in frame 0 [m2, rad2]; None where it is measured.
        covariance: (n, 3, 3) of the hand's place [m2, lab]; None where the row states none.
        offset: (n, 3) by which the hand is known to be elsewhere, which `covariance` is about [m, lab]; None without.
    """

    model: str
    base: Base
    encoder: Encoder
    trial_id: str
    kind: str
    t: np.ndarray
    T_lab_hand: np.ndarray
    base_variance: np.ndarray | None = None
    covariance: np.ndarray | None = None
    offset: np.ndarray | None = None


@dataclass(frozen=True)
class BaseMotion:
    """The base of one trial, measured and as the suspension predicts it, its marker body at the nominal place.

    Attributes:
        measured: (n, 6) displacement [m, rad, frame 0], NaN where the markers are not seen.
        predicted: Displacement (n, 6) by source of the wrench.
        rest: Frame 0; None where it was read from a file.
        slipping: The base that sticks and slips, its marker body as estimated, from the plate; None without one.
        slipped: The same by every source, with its poses; none where it was read from a file.
    """

    measured: np.ndarray
    predicted: tuple[tuple[Source, np.ndarray], ...]
    rest: Rest | None = None
    slipping: SlippingMotion | None = None
    slipped: tuple[tuple[Source, BasePrediction], ...] = ()


@dataclass(frozen=True)
class JointSamples:
    """Samples of one joint and its model, all (n,).

    Attributes:
        joint: Its name.
        t: [s, robot clock].
        theta: [rad].
        velocity: Motor side [rad/s].
        discrepancy: Motor minus link reading, the zero removed [rad].
        predicted: By the joint's printed model [rad].
        train: By its drive train [rad]; NaN without one.
        low: On the lower side of its gap, under the same torque [rad]; NaN without a drive train.
        high: On the upper side.
    """

    joint: str
    t: np.ndarray
    theta: np.ndarray
    velocity: np.ndarray
    discrepancy: np.ndarray
    predicted: np.ndarray
    train: np.ndarray
    low: np.ndarray
    high: np.ndarray


@dataclass(frozen=True)
class PredictedTrial:
    """Every row's prediction of one trial, and what they are made of, each once.

    Attributes:
        trial_id: The trial.
        kind: Its kind; empty where the trial was read from a file.
        t: (n,) [s, mocap clock]; of posture means their numbers.
        rows: Of the ladder; none where the trial was read from a file.
        base: None without a suspension.
        joints: Joints with a model and a link encoder, of a trial that moves.
        T_lab_B: (n, 4, 4) the base's marker body as measured; empty where the trial was read from a file.
        dwells: (k, 2) start and stop of the dwells of a static trial [s].
        corrected: Motor readings less the joint models, None without them.
        delivered: What the row that is delivered is made of, of a trial that moves; None where it was not predicted.
        frictions: Joint, Coulomb friction in this trial as the wrist's sensor shows it, and as calibrated [N.m].
    """

    trial_id: str
    kind: str
    t: np.ndarray
    rows: tuple[Prediction, ...] = ()
    base: BaseMotion | None = None
    joints: tuple[JointSamples, ...] = ()
    T_lab_B: np.ndarray = field(default_factory=lambda: np.zeros((0, 4, 4)))
    dwells: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    corrected: Corrected | None = None
    delivered: Delivered | None = None
    frictions: tuple[tuple[str, float, float], ...] = ()

    def save(self, folder: Path) -> None:
        """Write <trial>.nc into a folder that is there."""
        path = folder / f"{self.trial_id}.nc"
        part = path.with_name(path.name + ".part")
        with netcdf.created(part) as file:
            file.title = "predicted hand poses in the lab, displacement of the base, deflection of the joints"
            netcdf.add_dimensions(file, {"t": len(self.t), "axis": 3, "quaternion": 4, "twist": 6})
            netcdf.write_variable(file, "t", self.t, ("t",), "f8", {"units": "s", "clock": "mocap"})
            for row in self.rows:
                _write_row(file.createGroup(f"rows/{row.model}/{row.base}/{row.encoder}"), row.T_lab_hand)
            if self.base is not None:
                group = file.createGroup("base")
                for name, x in (("measured", self.base.measured), *self.base.predicted):
                    about = {"units": "m, rad", "frame": "0"}
                    netcdf.write_variable(group, name, x, ("t", "twist"), "f4", about, compressed=False)
                if self.base.slipping is not None:
                    _write_slipping(group.createGroup("slipping"), self.base.slipping)
            for joint in self.joints:
                _write_joint(file.createGroup(f"joints/{joint.joint}"), joint)
        os.replace(part, path)


def _write_row(group: netcdf.Group, T: np.ndarray) -> None:
    known = np.isfinite(T).all(axis=(1, 2))
    wxyz = np.full((len(T), 4), np.nan)
    wxyz[known] = Rotation.from_matrix(T[known, :3, :3]).as_quat(canonical=True, scalar_first=True)
    for name, x, last, unit in (
        ("position", T[:, :3, 3], "axis", "m"),
        ("quaternion_wxyz", wxyz, "quaternion", "-"),
    ):
        netcdf.write_variable(group, name, x, ("t", last), "f4", {"units": unit, "frame": "lab"}, compressed=False)


_SLIPPING = (
    ("x", ("t", "twist"), "m, rad"),
    ("variance", ("t", "twist"), "m2, rad2"),
    ("moment", ("t",), "N.m"),
    ("use", ("t", "wheel"), "-"),
)


def _write_slipping(group: netcdf.Group, motion: SlippingMotion) -> None:
    netcdf.add_dimensions(group, {"wheel": len(motion.wheels)})
    netcdf.write_labels(group, {"wheel": motion.wheels})
    for name, dimensions, units in _SLIPPING:
        netcdf.write_variable(group, name, getattr(motion, name), dimensions, "f4", {"units": units, "frame": "0"})


_JOINT = {"t": "s", "theta": "rad", "velocity": "rad/s", "discrepancy": "rad", "predicted": "rad"}
_JOINT |= dict.fromkeys(("train", "low", "high"), "rad")


def _write_joint(group: netcdf.Group, joint: JointSamples) -> None:
    netcdf.add_dimensions(group, {"sample": len(joint.t)})
    for name, units in _JOINT.items():
        netcdf.write_variable(group, name, getattr(joint, name), ("sample",), "f8", {"units": units})


def read_predicted(path: Path | str) -> PredictedTrial:
    """Base and joints of a saved trial.

    Raises:
        InputError: The file cannot be read.
    """
    path = Path(path)
    with netcdf.opened(path, _OPEN) as file:
        return PredictedTrial(
            path.stem, "", netcdf.array(file, "t"), base=_read_base(file), joints=tuple(_joints(file))
        )


def _read_base(file: netcdf.Group) -> BaseMotion | None:
    if "base" not in file.groups:
        return None
    group = file.groups["base"]
    sources: tuple[Source, ...] = ("plate", "dynamics")
    predicted = tuple((source, netcdf.array(group, source)) for source in sources if source in group.variables)
    own = group.groups.get("slipping")
    slipping = None
    if own is not None:
        x, variance, moment, use = (netcdf.array(own, name) for name, _, _ in _SLIPPING)
        slipping = SlippingMotion(x, variance, moment, use, netcdf.labels(own, "wheel"))
    return BaseMotion(netcdf.array(group, "measured"), predicted, slipping=slipping)


def _joints(file: netcdf.Group) -> Iterator[JointSamples]:
    if "joints" in file.groups:
        for name, group in file.groups["joints"].groups.items():
            yield JointSamples(name, *(_array_or_nan(group, field) for field in _JOINT))


def _array_or_nan(group: netcdf.Group, name: str) -> np.ndarray:
    return netcdf.array(group, name) if name in group.variables else np.full(len(group.dimensions["sample"]), np.nan)


def joint_samples(
    joints: JointModels | None, bundled: BundledRobot | None, trial: Trial, geared: CorrectedTrial | None
) -> Iterator[JointSamples]:
    """Samples of the joints that have a model and a link encoder."""
    if joints is None:
        return
    trains = {} if geared is None or bundled is None else bundled.encoder_differences(geared)
    names = joints.inputs.measured
    of_joints = samples_of(joints.of_trial(trial.id).inputs, trial, joints.zero)
    for model in joints.models:
        s = of_joints[names.index(model.joint)]
        if s is not None:
            predicted = model.discrepancy(s.theta, s.tau, s.velocity)
            by_train = np.full((3, len(s.t)), np.nan)
            if geared is not None and model.joint in trains:
                zero = joints.zero[names.index(model.joint)]
                by_train = np.array([np.interp(s.t, geared.loads.t, x - zero) for x in trains[model.joint]])
            yield JointSamples(model.joint, s.t, s.theta, s.velocity, s.y, predicted, *by_train)


def base_motion(
    T_lab_B: np.ndarray,
    found: Iterable[tuple[Source, tuple[Rest, np.ndarray] | None]],
    slipped: tuple[tuple[Source, BasePrediction], ...],
) -> BaseMotion | None:
    """The base by the sources that were recorded; None where none was."""
    there = [(source, *one) for source, one in found if one is not None]
    if not there:
        return None
    rest, own = there[0][1], next((one.motion for source, one in slipped if source == "plate"), None)
    return BaseMotion(rest.displacement(T_lab_B), tuple((source, x) for source, _, x in there), rest, own, slipped)
