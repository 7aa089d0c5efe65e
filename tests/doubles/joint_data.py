"""Trials whose link readings the printed equations made: what must come back exactly is known."""

import numpy as np

import mjcf
from calibration.options import Terms
from calibration.recording.clock import Clock
from calibration.recording.schema import Description
from calibration.recording.trial import Trial
from calibration.robot.chain import chain_of
from calibration.robot.hand import HandModel, nominal_hand
from calibration.robot.laboratory import Laboratory
from calibration.stages.joints.correction import InputModel, input_model
from calibration.stages.joints.model import JointModel, exponents
from tests.doubles import rigid_robot
from tests.doubles.rigid_robot import with_values

N = len(rigid_robot.JOINTS)
OFFSET = np.array([0.0, 4e-3, -3e-3, 4e-3, -4e-3, 0.106, 0.024, 0.027])
ZERO = np.array([np.nan, 4e-3, -1e-3, 2e-3, 5e-3, 0.11, 0.02, 0.03])
ROBOT = Clock("robot", 3.0, 2e-5, 1e-12 * np.eye(2), 0.0, 1e-6)


def described() -> Description:
    return rigid_robot.described()


LAB = Laboratory(mjcf.urdf(), described())


def hand() -> HandModel:
    nominal = nominal_hand(chain_of(mjcf.urdf(), described()), np.zeros(12))
    return with_values(nominal, offset=OFFSET)


def inputs() -> InputModel:
    return input_model(LAB, hand())


def truth(joint: str, terms: Terms, degree: int, rho: float, seed: int) -> JointModel:
    """A model with coefficients of about 1 mrad where |theta| and |tau| are about 1 rad and 10 N.m."""
    rng, powers = np.random.default_rng(seed), exponents(terms, degree)
    size = np.array([1e-3 * 10.0**-j for _, j in powers])
    wide = np.array([[-9.0, 9.0], [-99.0, 99.0]])
    A, B = size * rng.normal(size=(2, len(powers)))
    return JointModel(joint, terms, degree, powers, (), rho, A + 4.0 * size, B - 4.0 * size, wide, 0.0)


def motions(seed: int = 0, n: int = 6, seconds: float = 12.0) -> list[np.ndarray]:
    """Motor readings (m, 8) at 100 Hz: a second of rest, then all joints at unequal frequencies."""
    rng = np.random.default_rng(seed)
    t = np.arange(int((seconds + 2.0) * 100.0)) / 100.0
    s = np.clip(t - 1.0, 0.0, seconds)
    out = []
    for _ in range(n):
        amplitude = np.append(0.02, rng.uniform(0.3, 0.7, N - 1))
        f, phi = rng.uniform(0.1, 0.3, N), rng.uniform(0.0, 6.0, N)
        wave = np.sin(2.0 * np.pi * f * s[:, None] + phi) - np.sin(phi)
        out.append(rigid_robot.CENTRE + rng.uniform(-0.3, 0.3, N) + amplitude * wave)
    return out


def recorded(trial_id: str, q_motor: np.ndarray, y: np.ndarray, dwells: np.ndarray | None = None) -> Trial:
    """A trial without markers: q_link = q_motor - zero - y, y (m, 8) [rad]; dwells (n, 2) [s from its start]."""
    t = np.arange(len(q_motor)) / 100.0
    nothing = np.full_like(q_motor, np.nan)
    rests = ROBOT.to_mocap(np.zeros((0, 2)) if dwells is None else dwells)
    return Trial(
        trial_id, rigid_robot.JOINTS, t, q_motor, q_motor - ZERO - y, nothing, nothing, nothing, (), (), t,
        np.zeros((len(t), 0, 3)), dwell_start=rests[:, 0], dwell_stop=rests[:, 1],
    )  # fmt: skip


def made(models: list[JointModel], seed: int = 0) -> list[Trial]:
    """Moving trials whose discrepancies are the models', and a static one, both dwells in one posture, likewise."""
    moving = [(f"swing{k}", q, None) for k, q in enumerate(motions(seed))]
    still = np.repeat(rigid_robot.CENTRE[None], 400, axis=0)
    rests = np.array([[0.5, 2.0], [2.2, 3.8]])
    return [
        recorded(name, q, discrepancies(models, q), dwells) for name, q, dwells in [*moving, ("rest", still, rests)]
    ]


def discrepancies(models: list[JointModel], q: np.ndarray) -> np.ndarray:
    """What the models say (m, 8) [rad] at readings q (m, 8) at 100 Hz, 0 for joints without one."""
    found, y = inputs().inputs(np.arange(len(q)) / 100.0, q), np.zeros_like(q)
    for model in models:
        j = rigid_robot.JOINTS.index(model.joint)
        y[:, j] = model.discrepancy(found.theta[:, j], found.tau[:, j], found.velocity[:, j])
    return y
