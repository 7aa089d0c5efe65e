"""What hangs on the wrist's force-torque sensor, weighed by it in static postures.

    f = E R_base_sensor' w + f_0        tau = c x f + tau_0'        m = |w| / |g|

f, tau: ACTION of what hangs there on the sensor, its axes, about its origin; w its weight [N, base], m its mass [kg], c
its centre [m], f_0 the sensor's zero, tau_0' = tau_0 - c x f_0. E turns the sensor by the little that its axes are off:
the hand's markers identify R_base_sensor up to a constant on either side. w, E and f_0 by Gauss-Newton, c linearly;
standard deviations from the residuals, those of a posture together. A base out of level turns w and not m. A gain of
the sensor's passes for mass: a sensor that is 1 % off weighs 1 % wrong.
Nominal: all nominal links beyond the sensor, and the declared payload where it hangs there.

What the wrist's sensor says hangs on it, compared with the nominal links and the declared payload.

    R_base_sensor = R_base_B R_B_H R_H_tool R_tool_sensor       R_B_H measured by the markers in each dwell

Angles behind gears would not do: a hand that sags by 10 mrad always sags with gravity, and weighs 1 % less.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from calibration.errors import NotEnoughData, ShapeError
from calibration.mocap.postures import Postures, dwell_windows
from calibration.numerics.lie import from_vector, inverse, skew
from calibration.recording.clock import Clock
from calibration.recording.trial import Trial
from calibration.robot.hand import HandModel
from calibration.robot.laboratory import Laboratory
from calibration.robot.wrist_sensor import hangs, hung_bodies
from calibration.stages.geometry.model_of_fit import hand_of
from calibration.stages.stage import Stage, StageInput, StageResult
from calibration.verdict import Verdict

_FEWEST = 6  # postures
_STEPS = 8
_SPREAD = 0.1  # of gravity: smallest spread of its direction over the sensor's axes that shows all of a centre [-]
_STAGE = "geometry"
_CLEAR = 3.0  # standard deviations
_FEW = 5  # samples of a dwell
_SETTLED = 0.5  # share of a dwell after which an arm has stopped ringing: a mean over turned forces is too small


@dataclass(frozen=True)
class Hanging:
    """Mass and first moment of something, and how well they are known.

    Attributes:
        mass: m [kg].
        moment: h = m c (3,) [kg.m], in the sensor's axes from its origin.
        covariance: (4, 4) of (m, h).
    """

    mass: float
    moment: np.ndarray
    covariance: np.ndarray

    @property
    def sigma(self) -> np.ndarray:
        """Standard deviations (4,) of m [kg] and h [kg.m]."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def centre(self) -> np.ndarray:
        """c (3,) [m]."""
        return np.asarray(self.moment / self.mass)

    @property
    def centre_sigma(self) -> np.ndarray:
        """Standard deviations (3,) of c [m]."""
        J = np.column_stack([-self.centre, np.eye(3)]) / self.mass
        return np.sqrt(np.diag(J @ self.covariance @ J.T))

    def less(self, other: "Hanging") -> "Hanging":
        """What hangs there besides `other`."""
        return Hanging(self.mass - other.mass, self.moment - other.moment, self.covariance + other.covariance)


def weigh(R: np.ndarray, wrench: np.ndarray, gravity: np.ndarray) -> Hanging:
    """What hangs on the sensor.

    Args:
        R: R_base_sensor (n, 3, 3) at static postures.
        wrench: Mean readings (n, 6) [N, N.m] there.
        gravity: (3,) in the base [m/s2].

    Raises:
        NotEnoughData: Too few postures, or gravity hardly turns in the sensor's axes.
    """
    if wrench.shape != (len(R), 6):
        raise ShapeError("wrench", wrench.shape, (len(R), 6))
    a = np.swapaxes(R, 1, 2) @ gravity
    if len(a) < _FEWEST or np.sqrt(np.linalg.eigvalsh(np.cov(a.T))[0]) < _SPREAD * np.linalg.norm(gravity):
        raise NotEnoughData(
            f"{len(a)} postures do not turn the wrist's sensor enough against gravity to weigh what hangs on it; "
            "record some with the hand up, down and on its side"
        )
    w, C_w = _weight(R, wrench[:, :3], gravity)
    f = wrench[:, :3] - wrench[:, :3].mean(axis=0)
    c, C_c = (x[..., :3] for x in _least_squares(np.concatenate([-skew(f), _ones(len(f))], axis=2), wrench[:, 3:]))
    g, along = float(np.linalg.norm(gravity)), w / np.linalg.norm(w)
    m, var = float(w @ along) / g, float(along @ C_w @ along) / g**2
    J = np.append(1.0, c)
    covariance = var * np.outer(J, J)
    covariance[1:, 1:] += m**2 * C_c[:3]
    return Hanging(m, m * c, covariance)


def _weight(R: np.ndarray, f: np.ndarray, gravity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """w (3,) [N, base] and its covariance (3, 3), from forces f (n, 3)."""
    E, w = np.eye(3), gravity / np.linalg.norm(gravity) * np.linalg.norm(f - f.mean(axis=0), axis=1).mean()
    for _ in range(_STEPS):
        turned = E @ np.swapaxes(R, 1, 2)
        A = np.concatenate([turned, -skew(turned @ w), _ones(len(f))], axis=2)
        step, C = _least_squares(A, f - turned @ w)
        w, E = w + step[:3], Rotation.from_rotvec(step[3:6]).as_matrix() @ E
    return w, C[:3, :3]


def _ones(n: int) -> np.ndarray:
    return np.broadcast_to(np.eye(3), (n, 3, 3))


def _least_squares(A: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Solution and covariance for blocks A (n, 3, p) and y (n, 3), whose rows of one posture share their errors."""
    J = A.reshape(-1, A.shape[2])
    G = np.linalg.inv(J.T @ J)
    x = G @ (J.T @ y.ravel())
    H = np.eye(3) - A @ G @ np.swapaxes(A, 1, 2)  # what a posture leaves of its own error
    psi = np.einsum("pq,nkq,nk->np", G, A, np.linalg.solve(H, (y - A @ x)[..., None])[..., 0])
    return x, psi.T @ psi


def expected_load(lab: Laboratory, link: str) -> Hanging:
    """What hangs on the sensor at `link` by the nominal links and the declared payload, as wide as their tolerances."""
    model, description = pin.buildModelFromXML(lab.urdf), lab.description
    data, sensor = model.createData(), model.getFrameId(link)
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    tolerance, payload = description.tolerances, description.payload
    parts = [
        (b.mass, b.lever, tolerance.link_mass * b.mass, tolerance.link_com) for b in hung_bodies(model, data, sensor)
    ]
    if payload is not None and hangs(model, model.getFrameId(payload.link), sensor):
        at = data.oMf[model.getFrameId(payload.link)].act(np.array(payload.com))
        parts.append((payload.mass, at, payload.tolerance, 0.0))
    masses, widths, off = (np.array([part[k] for part in parts]) for k in (0, 2, 3))
    c = np.array([data.oMf[sensor].actInv(part[1]) for part in parts]).reshape(-1, 3)
    J = np.column_stack([np.ones(len(c)), c])
    covariance = J.T @ (widths[:, None] ** 2 * J)
    covariance[1:, 1:] += np.eye(3) * float(((masses * off) ** 2).sum())
    return Hanging(float(masses.sum()), masses @ c, covariance)


def weighed(
    lab: Laboratory,
    trials: Sequence[Trial],
    robot: Clock | None,
    hand: HandModel,
    postures: Postures,
) -> tuple[Verdict, ...]:
    """Verdicts on the load of the hand; nothing where no wrist was recorded.

    Args:
        lab: Nominal robot and setup, its payload that of these trials.
        trials: Continuous ones; their dwells count.
        robot: The robot's clock.
        hand: The calibrated robot.
        postures: Those of the trials that show base and hand.
    """
    recorded = [trial for trial in trials if np.isfinite(trial.wrist_wrench).any()]
    if not recorded or robot is None:
        return ()
    description, link = lab.description, lab.description.wrist_link
    if link is None:
        return (Verdict(_STAGE, "missing", "wrist_wrench is recorded, but wrist_link does not name where: not used"),)
    w = _means(recorded, robot)
    rows = [k for k, label in enumerate(postures.label) if label in w and postures.components == 6]
    if not rows:
        return (Verdict(_STAGE, "missing", "wrist_wrench is recorded, but in no static posture: not used"),)
    seen = postures.rows(np.array(rows))
    R = _turned(hand, seen, link)
    try:
        found = weigh(R, np.array([w[label] for label in seen.label]), np.array(description.gravity))
    except NotEnoughData as error:
        return (Verdict(_STAGE, "missing", str(error)),)
    return (_judged(found, expected_load(lab, link), link, len(seen)),)


def _turned(hand: HandModel, postures: Postures, link: str) -> np.ndarray:
    """R_base_sensor (n, 3, 3)."""
    q = hand.angles(postures.q)
    T_base_tool = from_vector(hand.base) @ postures.T_base_hand @ inverse(from_vector(hand.hand)[None])
    T_tool_sensor = inverse(hand.chain.poses(q)) @ hand.chain.poses(q, link)
    return np.asarray((T_base_tool @ T_tool_sensor)[:, :3, :3])


def _means(trials: Sequence[Trial], robot: Clock) -> dict[str, np.ndarray]:
    """Mean wrench (6,) of each dwell by the label of its posture."""
    found = {}
    for trial in trials:
        t, known = robot.to_mocap(trial.t_robot), np.isfinite(trial.wrist_wrench).all(axis=1)
        for k, (start, stop) in enumerate(dwell_windows(trial)):
            rows = (t >= start + _SETTLED * (stop - start)) & (t <= stop) & known
            if rows.sum() >= _FEW:
                found[f"{trial.id} {k}"] = trial.wrist_wrench[rows].mean(axis=0)
    return found


def _judged(found: Hanging, expected: Hanging, link: str, n: int) -> Verdict:
    message = (
        f"wrist: {found.mass:.3f} +- {found.sigma[0]:.1g} kg on {link}, centre {_millimetres(found.centre)} mm "
        f"+- {_millimetres(found.centre_sigma, 1)}, "
        f"{n} postures; nominal links and declared payload: {expected.mass:.3f} +- {expected.sigma[0]:.3f} kg"
    )
    more = found.less(expected)
    if abs(more.mass) <= _CLEAR * more.sigma[0]:
        return Verdict(_STAGE, "ok", message)
    if more.mass > 0.0:
        at = _millimetres(more.centre)
        remedy = f"declare the other {more.mass:.3f} kg, at {at} mm in its axes, as payload, or weigh the tool"
    else:
        remedy = "is the declared payload in the hand, the sensor in newton?"
    return Verdict(_STAGE, "warning", f"{message}: {remedy}")


def _millimetres(x: np.ndarray, digits: int = 0) -> str:
    return "(" + ", ".join(f"{1e3 * v:.{digits}f}" for v in x) + ")"


def _run(data: StageInput) -> StageResult:
    """The load in the trials with the declared payload."""
    model = data.model("model_2")
    if model is None or data.postures is None:
        return StageResult()
    declared = {entry.id for entry in data.lab.description.trials if entry.payload is None}
    trials = [trial for trial in data.trials if trial.id in declared]
    hand = hand_of(model, data.lab.chain, data.lab.nominal_frames)
    return StageResult(findings=weighed(data.lab, trials, data.clock("robot"), hand, data.postures))


WRIST_LOAD = Stage("wrist_load", _run, lacks=lambda data: "", needs="geometry")
