"""A base on six wheels that slips as the model says, integrated literally, step by step and wheel by wheel."""

from dataclasses import dataclass

import numpy as np

from calibration.numerics.signals import RATE
from calibration.stages.stick_slip.forcing import STEP, STEPS, PlanarForcing
from calibration.stages.stick_slip.kernel.bases import COLUMNS, FAR, F
from calibration.stages.stick_slip.kernel.integration import advance
from calibration.stages.stick_slip.kernel.wheel_forces import deflect_at_rest
from calibration.stages.stick_slip.likelihood import Trials, bases_of, joined
from calibration.stages.stick_slip.measured import PlanarMotion, blocks
from calibration.stages.stick_slip.wheels import SlipParameters, WheelSet

POSITION = np.array([[0.0, -0.2], [0.0, 0.2], [0.15, -0.1], [0.15, 0.1], [-0.19, -0.1], [-0.19, 0.1]])
WHEELS = WheelSet(
    ("right", "left", "front_right", "front_left", "back_right", "back_left"),
    ("drive", "drive", "front", "front", "back", "back"),
    POSITION,
    np.array([40.0, 40.0, 0.0, 0.0, 0.0, 0.0]),
    radius=np.array([0.1, 0.1, 0.03, 0.03, 0.03, 0.03]),
)
TRUTH = SlipParameters(4200.0, 7700.0, 14e3, 24e3, 0.55, 0.24, 0.065, 140.0, 70.0, 3.0, 0.5, 1.05, 0.95)
MASS = np.array([[74.0, 0.0, -1.5], [0.0, 74.0, 2.0], [-1.5, 2.0, 3.5]])
WEIGHT = np.array([730.0, 20.0, 3.0])  # -Fz, My, -Mx


@dataclass(frozen=True)
class Motion:
    """At every step: position (n, 3), velocity, force on the floor, and deflections (n, m, 2)."""

    x: np.ndarray
    v: np.ndarray
    force: np.ndarray
    e: np.ndarray
    slides: np.ndarray


def about(x: np.ndarray, load: np.ndarray) -> np.ndarray:
    """-Fz, My, -Mx about the axes of a base that moved by x (3,), of those about where it was."""
    c, s = np.cos(x[2]), np.sin(x[2])
    first, second = load[1] - load[0] * x[0], load[2] - load[0] * x[1]
    return np.array([load[0], c * first + s * second, c * second - s * first])


def across(q: np.ndarray) -> np.ndarray:
    """A (2, 3) of a place q (2,): its velocity by that of the base."""
    return np.array([[1.0, 0.0, -q[1]], [0.0, 1.0, q[0]]])


def leaning(rx: float, ry: float) -> np.ndarray:
    """What a force of 1 N upwards is in the floor's plane of a base that leans."""
    return np.array([-ry, rx])


def literal(
    w: np.ndarray, p: SlipParameters = TRUTH, tilt: np.ndarray | None = None, plate: bool = False, of: WheelSet = WHEELS
) -> Motion:
    """The equations of `integration` by its docstring, under w (n, 3); a plate reads the load, corrects nothing."""
    rows, tilt, h = of.rows(p), np.zeros((len(w), 2)) if tilt is None else tilt, STEP
    M = MASS - sum(m * across(q).T @ across(q) for m, q in zip(WHEELS.mass, WHEELS.position, strict=True))
    x, v, a, more, u = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros((len(rows), 2))
    e, out = -(rows[:, 6] + rows[:, 7:10] @ WEIGHT - WHEELS.weight)[:, None] * leaning(*tilt[0]) / rows[:, 2:4], []
    e[:, 0] += rows[:, 12] * FAR**2 / (FAR**2 + ((WEIGHT[1:] - WHEELS.usual) ** 2).sum())
    for k, force in enumerate(w):
        load, more = (about(x, WEIGHT) if plate else WEIGHT) + more, np.zeros(3)
        less = rows[:, 15] * (e @ -leaning(*tilt[k]))
        assert np.all(rows[:, 6] + rows[:, 7:10] @ load > less)
        now = v + 0.5 * h * a
        floor, on_base = np.array([p.body_c, p.body_c, p.body_cr]) * now, np.zeros(3)
        slides = np.zeros(len(rows), dtype=bool)
        for i, (kx, ky, c, mu, n, *G, m, r) in enumerate(rows[:, 2:12]):
            N, K, A, faster = n + np.dot(G, load) - less[i], np.array([kx, ky]), across(rows[i, :2] - e[i]), np.zeros(2)
            stuck = e[i] + A @ v * h - 0.5 * h * u[i]
            f = K * stuck + c * A @ now + (N - WHEELS.weight[i]) * leaning(*tilt[k]) + m / h * u[i]
            at = across(rows[i, :2] - stuck)
            if np.linalg.norm(f) > mu * N:
                left = f * (1.0 - mu * N / np.linalg.norm(f))
                f, slides[i], faster = f - left, True, left / (m / h + c + 0.5 * K * h)
            g = f + m * (faster - u[i]) / h
            e[i] = stuck - 0.5 * h * faster
            u[i] = faster
            more[1:] += N * (e[i] + r * leaning(*tilt[k]))
            more += less[i] * np.array([1.0, *rows[i, :2]])
            floor, on_base = floor + at.T @ f, on_base + at.T @ (g - f)
        yaw = x[2] + 0.5 * h * v[2]
        x = x + h * np.array([np.cos(yaw) * v[0] - np.sin(yaw) * v[1], np.sin(yaw) * v[0] + np.cos(yaw) * v[1], v[2]])
        out.append((x, v, floor, e.copy(), slides))
        a = np.linalg.solve(M, force - floor - on_base)
        v = v + h * a
    return Motion(*(np.array(column) for column in zip(*out, strict=True)))


def slid(  # noqa: PLR0913
    w: np.ndarray,
    p: SlipParameters = TRUTH,
    load: np.ndarray = WEIGHT,
    preload: np.ndarray | None = None,
    of: WheelSet = WHEELS,
    mass: np.ndarray = MASS,
) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n, 3) and forces on the floor (n, 3) at every step, by the kernel itself, under w (n, 3)."""
    (state,), (wheels,), (lanes,), _ = bases_of(of, p.logarithms[None], False, preload)
    drive, inertia = np.zeros((len(w), COLUMNS)), np.zeros(15)
    drive[:, :3], drive[:, 3:6], inertia[:6] = w, load, mass[np.triu_indices(3)]
    deflect_at_rest(wheels.reshape(-1), drive[0], lanes)
    x, force = np.empty((len(w), 3)), np.empty((len(w), 3))
    for k in range(len(w)):
        advance(state, wheels, drive[k : k + 1], inertia, STEP, lanes)
        x[k], force[k] = state[:3, 0], state[F : F + 3, 0]
    return x, force


def push(rng: np.random.Generator, seconds: float = 8.0, size: float = 1.0) -> np.ndarray:
    """Forces (n, 3) in the plane at every step: a second of rest, then swings with two jolts."""
    t = np.arange(round(seconds / STEP)) * STEP
    f, phase = rng.uniform(0.2, 0.6, 3), rng.uniform(0.0, 6.0, 3)
    swing = np.sin(2.0 * np.pi * f * (t[:, None] - 1.0) + phase) - np.sin(phase)
    jolts = sum(np.exp(-(((t - at) / 0.06) ** 2)) for at in rng.uniform(1.5, seconds - 1.0, 2))
    w = swing * [4.0, 6.0, 3.0] + jolts[:, None] * rng.choice([-1.0, 1.0], 3) * [30.0, 60.0, 40.0]
    return size * w * (t >= 1.0)[:, None]


def forcing(w: np.ndarray, plate: np.ndarray | None = None) -> PlanarForcing:
    """What the kernel takes under w (n, 3), with a plate that reads `plate` (n, 3) or without."""
    n = len(w) // STEPS
    drive = np.zeros((n * STEPS, COLUMNS))
    drive[:, :3], drive[:, 3:6] = w[: n * STEPS], WEIGHT
    if plate is not None:
        drive[:, 8:11] = plate[: n * STEPS]
    inertia = np.zeros((n, 15))
    inertia[:, :6] = MASS[np.triu_indices(3)]
    t = np.arange(n) / RATE
    source, none = "dynamics" if plate is None else "plate", np.zeros((n, 3))
    return PlanarForcing("a", source, t, drive, inertia, none, t <= 1.0, none)


def recorded(
    rng: np.random.Generator, noise: float = 2e-5, plate: bool = True, truth: SlipParameters = TRUTH
) -> tuple[PlanarForcing, PlanarMotion]:
    """A trial and what its markers show."""
    w = push(rng)
    x, force = slid(w, truth)
    one = forcing(w, force if plate else None)
    sigma = noise * np.array([1.0, 1.0, 4.0])
    x = blocks(x[STEPS - 1 :: STEPS])
    return one, PlanarMotion(x + sigma * rng.normal(size=x.shape), np.ones(len(x), dtype=bool), sigma)


def campaign(n: int, seed: int, plate: bool = True, truth: SlipParameters = TRUTH) -> Trials:
    """n trials."""
    rng = np.random.default_rng(seed)
    return joined(WHEELS, [recorded(rng, plate=plate, truth=truth) for _ in range(n)])
