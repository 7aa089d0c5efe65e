"""Full geometric calibration from arrays: a URDF, joint readings, marker positions. No file, no datasheet.

The laboratory's frame, the marker body's place on the tool and its shape are unknown; three markers or more are
compressed to one pose a posture, fewer give a position. Estimated are both frames, six increments for every joint
placement, the zero of every reading, compliance and backlash of every gear, as by `calibrate` (`gear_deflection`),
together with the readings' and the hand's random errors and the priors' widths (`evidence`). Postures that no error of
the robot explains are left out and named. Intervals are as wide as errors at postures left out in turn show.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from calibration.errors import CalibrationError, NotCalibrated, NotEnoughData, ShapeError
from calibration.inference.identifiability import Identifiability
from calibration.inference.map_estimate import Fit
from calibration.inference.parameters import ParameterSet
from calibration.mocap.cluster_shape import Cluster, cluster, in_line
from calibration.mocap.postures import Postures
from calibration.numerics.alignment import registration_start
from calibration.numerics.lie import compose
from calibration.recording.schema import Tolerances
from calibration.robot.blocks import BacklashPreload
from calibration.robot.chain import Chain, chain_of_frames
from calibration.robot.hand import HandModel
from calibration.robot.hand_uncertainty import Predicted, Session, Spread, predicted_points
from calibration.robot.parameter_block import Known, joint_lengths, parameters_of
from calibration.stages.geometry.cross_validation import errors_left_out, in_words, multiplied
from calibration.stages.geometry.gear_deflection import GearFit, fit_gears, without
from calibration.stages.geometry.guards import unusable_data
from calibration.stages.geometry.hand_residual import HAND_NAMES, NoiseModel
from calibration.stages.geometry.parameters import hand_model, reading_names
from calibration.verdict import Verdict

_STAGE = "geometry"
_LEAST = 1e-6  # [m, rad] smallest noise of a measured pose
_LEAST_READING = 2e-5  # [rad, a tenth of it in m] smallest random error of a reading
_FIXED = 1e-6  # [rad]


@dataclass(frozen=True)
class Widths:
    """Standard deviations to begin with; the data move them. Those of a mapping file that states no tolerances.

    Attributes:
        translation: Of a joint placement, per axis [m].
        rotation: Of a joint placement, per axis [rad].
        offset: Of a reading's zero [rad, a tenth of it in m].
        deflection: Of a gear at its own largest gravity torque [rad, a tenth of it in m].
        reading: Of a joint's random reading error [rad, a tenth of it in m].
        position: Of the hand's random position error [m].
        orientation: Of the hand's random rotation error [rad].
        marker: Of a marker's mean position, least [m]; distances within the body show it where it is more.
    """

    translation: float = 3e-3
    rotation: float = 6e-3
    offset: float = 6e-2
    deflection: float = 3e-2
    reading: float = 8e-3
    position: float = 5e-4
    orientation: float = 1e-3
    marker: float = _LEAST


@dataclass(frozen=True)
class GeometryFit:
    """A calibrated robot.

    Attributes:
        hand: The robot: T_B_H is the marker body's pose in the laboratory.
        parameters: What was estimated.
        fit: Values, covariance, random errors.
        markers: (m, 3) in the hand's frame [m]; one at its origin where a point was seen.
        left_out: Numbers of the postures that were not used.
        verdicts: Findings, postures left out among them.
        known: Rank, condition and combinations of parameters.
    """

    hand: HandModel
    parameters: ParameterSet
    fit: Fit
    markers: np.ndarray
    left_out: tuple[int, ...]
    verdicts: tuple[Verdict, ...]
    known: Identifiability

    def predict(self, q: np.ndarray) -> np.ndarray:
        """Marker positions (n, m, 3) [m, lab] at readings q (n, n_joints) [rad, m]."""
        T = self.hand.poses(q)
        return np.einsum("nij,mj->nmi", T[:, :3, :3], self.markers) + T[:, None, :3, 3]

    def predict_with_covariance(self, q: np.ndarray, session: Session | None = None) -> Predicted:
        """The same with covariance, of this session, or of any other one where `session` is given."""
        spread = _spread(self.hand.nominal, self.parameters, self.fit)
        return predicted_points(self.hand, spread, self.markers, q, session)


def fit_geometry(
    urdf: str,
    joints: Sequence[str],
    tool: str,
    q: np.ndarray,
    positions: np.ndarray,
    base: str = "universe",
    widths: Widths | None = None,
) -> GeometryFit:
    """Calibrate a robot's chain.

    Args:
        urdf: Text of a URDF.
        joints: Names of the columns of q.
        tool: Frame that carries the markers.
        q: (n, n_joints) readings at rest [rad, m].
        positions: (n, m, 3) markers in a frame at rest with the base [m]; NaN where not seen.
        base: Frame the chain starts from.
        widths: To begin with.

    Raises:
        ShapeError, NotEnoughData: The arrays do not belong together or hold no usable posture.
        NoSuchElement, InputError: Not a joint, frame or URDF.
        NotCalibrated: The result must not be used, with every reason.
    """
    chain, widths = chain_of_frames(urdf, tuple(joints), base, tool), widths or Widths()
    found = fit_chain(chain, q, positions, widths)
    postures, _, _ = _postures(*_arrays(q, positions), widths.marker)
    left = errors_left_out("full", partial(_fitted, chain, widths), chain, postures)
    words = Verdict(_STAGE, "ok", in_words(left) + multiplied(left.excess))
    return replace(_scaled(found, left.excess), verdicts=(*found.verdicts, words))


def fit_chain(chain: Chain, q: np.ndarray, positions: np.ndarray, widths: Widths) -> GeometryFit:
    """`fit_geometry` of a chain that was made before, with the intervals that the fit states by itself."""
    q, positions = _arrays(q, positions)
    postures, markers, usable = _postures(q, positions, widths.marker)
    nominal, found = _gears(chain, postures, widths)
    used = found.robust.kept
    left_out = tuple(sorted({*np.flatnonzero(~usable).tolist(), *np.flatnonzero(usable)[~used].tolist()}))
    verdicts = (*_verdicts(left_out, len(q), found.known, found.parameters), *without(found.negative))
    hand = nominal.with_theta(found.fit.theta, found.parameters.names)
    return GeometryFit(hand, found.parameters, found.fit, markers, left_out, verdicts, found.known)


def _arrays(q: np.ndarray, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    q, positions = np.asarray(q, dtype=float), np.asarray(positions, dtype=float)
    if positions.ndim != 3 or positions.shape[0] != len(q) or positions.shape[2] != 3:
        raise ShapeError("positions", positions.shape, (len(q), "markers", 3))
    return q, positions


def _gears(chain: Chain, postures: Postures, widths: Widths) -> tuple[HandModel, GearFit]:
    """The nominal robot and its fit.

    Raises:
        NotCalibrated: It must not be used.
    """
    oriented = postures.components == 6
    start = registration_start(chain.poses(postures.q), postures.T_base_hand, oriented)
    if refused := list(unusable_data(chain, postures.q, start, postures.components)):
        raise NotCalibrated(refused)
    nominal, reading = hand_model(chain, start.frames), widths.reading * joint_lengths(chain)
    less, more = _parameters(nominal, widths, chain.gravity_torques(postures.q), oriented)
    pose = np.array([widths.position, widths.orientation][: 1 + oriented])
    found = fit_gears(nominal, less, more, postures, NoiseModel(reading, _LEAST_READING * joint_lengths(chain), pose))
    if found.rejected:
        raise NotCalibrated(found.rejected)
    return nominal, found


def _fitted(chain: Chain, widths: Widths, postures: Postures) -> tuple[HandModel, Spread] | None:
    """The robot of some postures and what it states; None where it must not be used."""
    try:
        nominal, found = _gears(chain, postures, widths)
    except CalibrationError:
        return None
    return nominal.with_theta(found.fit.theta, found.parameters.names), _spread(chain, found.parameters, found.fit)


def _spread(chain: Chain, parameters: ParameterSet, fit: Fit) -> Spread:
    return Spread(parameters.names, fit.covariance, fit.noise_sigma(reading_names(chain)), fit.noise_sigma(HAND_NAMES))


def _scaled(found: GeometryFit, factor: float) -> GeometryFit:
    """With all standard deviations times a factor [-]."""
    fit = found.fit
    widths = replace(fit.widths, noise=factor * fit.widths.noise)
    return replace(found, fit=replace(fit, covariance=factor**2 * fit.covariance, widths=widths))


def _verdicts(
    left_out: tuple[int, ...], n: int, known: Identifiability, parameters: ParameterSet
) -> tuple[Verdict, ...]:
    message = f"{known.rank} combinations of {len(parameters)} parameters from {n - len(left_out)} postures"
    verdicts = [Verdict(_STAGE, "ok", f"{message}, condition {known.condition:.0f}")]
    if left_out:
        message = f"{len(left_out)} of {n} postures contradict the others and were left out, counted from 0: "
        verdicts.append(Verdict(_STAGE, "warning", message + ", ".join(map(str, left_out))))
    return tuple(verdicts)


def _postures(q: np.ndarray, positions: np.ndarray, marker: float) -> tuple[Postures, np.ndarray, np.ndarray]:
    """Postures of the usable rows, the markers in the hand's frame, and which rows (n,) are usable."""
    finite = np.isfinite(q).all(axis=1)
    if positions.shape[1] == 1:
        usable = finite & np.isfinite(positions[:, 0]).all(axis=1)
        T = compose(np.tile(np.eye(3), (int(usable.sum()), 1, 1)), positions[usable, 0])
        noise = np.tile(marker**2 * np.eye(3), (len(T), 1, 1))
        return Postures(q[usable], T, noise, np.zeros(len(T))), np.zeros((1, 3)), usable
    if in_line(positions):
        raise NotEnoughData("markers of a body must be three or more, not in line; or give one of them alone")
    body: Cluster = cluster(positions)
    usable = finite & ~body.odd & np.isfinite(body.T).all(axis=(1, 2))
    larger = max(1.0, marker / max(body.sigma, 1e-2 * _LEAST))
    covariance = larger**2 * body.covariance[usable] + np.diag(np.full(6, _LEAST**2))
    return Postures(q[usable], body.T[usable], covariance, np.zeros(int(usable.sum()))), body.xyz, usable


def _parameters(hand: HandModel, widths: Widths, tau: np.ndarray, oriented: bool) -> tuple[ParameterSet, ParameterSet]:
    """Without and with backlash. Frames have no prior, but the hand's rotation, fixed where only a point was seen."""
    tolerances = Tolerances(
        joint_translation=widths.translation,
        joint_rotation=widths.rotation,
        encoder_offset=widths.offset,
        joint_play=widths.reading,
        body_translation=1.0,
        body_rotation=1.0,
        link_mass=1.0,
        link_com=1.0,
    )
    frames = np.full(12, np.inf)
    frames[9:] = np.inf if oriented else _FIXED
    known = Known(hand.nominal, tolerances, frames, tau, widths.deflection)
    more = parameters_of(hand.blocks, known)
    less = parameters_of([b for b in hand.blocks if not isinstance(b, BacklashPreload)], known)
    return less, more
