"""Wheels of the stick-slip base: stiffness, damping, friction and share of the vertical load, tied by type.

    k = (kx, ky) of a drive, (k, k) of a front or back caster       c of drives, of casters      mu of the three types
    N_i = n_i + k_i (a + b x_i + c y_i),   sum_i N_i (1, x_i - l_x, y_i - l_y) = (-Fz, My, -Mx)   k_i 1 of front casters

The base's weight is shared as by vertical springs under a rigid base. A wheel carries n_i of its own weight m_i g, of
the nominal robot: it stands on a tyre in series with its spring, n_i = m_i g (1 - k / k_tyre), k of both; the rest goes
to all wheels. A wheel that would pull is off the floor. Casters are front or back of the axle of the drives. Priors
are log-normal and wide, but for the shares of the load where the tilt shows them: nothing here is of one robot.

Where a robot stands, its wheels may hold each other along x: drives and back casters push, front casters against them.
The first slips let go of that, and leave the base elsewhere. It is fitted where trials show it, see `search.holding`.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np
import pinocchio as pin
from scipy.constants import g as STANDARD_GRAVITY

from calibration.errors import ShapeError
from calibration.recording.schema import Wheel

NAMES = (
    "drive_kx", "drive_ky", "front_k", "back_k", "drive_mu", "front_mu", "back_mu",
    "drive_c", "caster_c", "body_c", "body_cr", "drive_load",
    "back_load", "load_x", "load_y", "drive_held", "back_held",
)  # fmt: skip
LOGARITHMS = NAMES.index("load_x")  # of the coordinates; the others are places and forces
PLACES, HELD = slice(LOGARITHMS, LOGARITHMS + 2), slice(LOGARITHMS + 2, None)
LENGTH, FORCE = 0.01, 3.0  # [m, N] that count as 1 beside logarithms
_SIZES = np.array([LENGTH, LENGTH, FORCE, FORCE])
PRIOR = np.append(np.log([8e3, 8e3, 16e3, 16e3, 0.6, 0.2, 0.1, 100.0, 100.0, 5.0, 0.5, 1.0, 1.0]), [0.0, 0.0, 0.0, 0.0])
PRIOR_SIGMA = np.array([1.0, 1.0, 1.0, 1.0, 0.35, 0.7, 0.7, 1.0, 1.0, 1.5, 1.5, 0.5, 0.5, 0.2, 0.2, 1e-3, 1e-3])
DRIVES = 0.1  # of the logarithm of the drives' friction: a drive slides for hundredths of a second, seldom
_OWN = 0.8  # 1 - k / k_tyre
_HOLDING = np.array([0.3, 0.2])  # sigmas of what drives and back casters hold, where that is fitted [FORCE]
PRELOADS = 16  # ways in which a base may stand before a trial
PRELOAD = 2.0  # [N] that a wheel may bear at rest; less where it would slip
LOADS = [NAMES.index("drive_load"), NAMES.index("back_load")]
_ALIKE, _IN_PLACE = np.ones(2), np.zeros(2)
_NEAR = 0.01  # [m] between a wheel's declared hub and the joint of the nominal robot that is it


@dataclass(frozen=True)
class Prior:
    """Normal one of the coordinates: mean and sigma (17,)."""

    mean: np.ndarray
    sigma: np.ndarray

    def cost(self, at: np.ndarray) -> float:
        """-2 log of it."""
        return float((((at - self.mean) / self.sigma) ** 2).sum())

    def bounded(self, at: np.ndarray) -> np.ndarray:
        """Coordinates (..., 17) within three sigmas."""
        return np.clip(at, self.mean - 3.0 * self.sigma, self.mean + 3.0 * self.sigma)

    @property
    def holding(self) -> "Prior":
        """The same of wheels that may hold each other where trials begin; else they are taken not to."""
        return replace(self, sigma=np.append(self.sigma[: HELD.start], _HOLDING))

    @property
    def shares(self) -> np.ndarray:
        """(2,) of the load that drives and back casters bear, relative to front casters [-]."""
        return np.asarray(np.exp(self.mean[LOADS]))

    @cached_property
    def information(self) -> np.ndarray:
        """(17, 17)."""
        return np.diag(self.sigma**-2.0)


WIDE = Prior(PRIOR, PRIOR_SIGMA)


@dataclass(frozen=True)
class SlipParameters:
    """Parameters by wheel type, all positive, and where the load is.

    Attributes:
        drive_kx: Stiffness along x of a drive wheel [N/m].
        drive_ky: Along y.
        front_k: Of a front caster, in both directions [N/m].
        back_k: Of a back caster [N/m].
        drive_mu: Friction of a drive wheel [-].
        front_mu: Of a front caster.
        back_mu: Of a back caster.
        drive_c: Damping of a drive wheel [N.s/m].
        caster_c: Of a caster [N.s/m].
        body_c: Damper of the base against the floor [N.s/m].
        body_cr: The same about the vertical [N.m.s/rad].
        drive_load: Share of the base's weight on a drive wheel, over what a front caster in its place would bear [-].
        back_load: The same of a back caster [-].
        load_x: How far ahead of where it is counted the load is, and the wheels, on which it is counted, behind [m].
        load_y: How far to the left, and the wheels to the right.
        drive_held: Force by which a drive pushes the floor ahead where most trials begin, held by front casters [N].
        back_held: The same of a back caster.
    """

    drive_kx: float
    drive_ky: float
    front_k: float
    back_k: float
    drive_mu: float
    front_mu: float
    back_mu: float
    drive_c: float
    caster_c: float
    body_c: float
    body_cr: float
    drive_load: float
    back_load: float
    load_x: float = 0.0
    load_y: float = 0.0
    drive_held: float = 0.0
    back_held: float = 0.0

    @classmethod
    def of(cls, logarithms: np.ndarray) -> "SlipParameters":
        """From coordinates (17,), see `values_of`."""
        return cls(*(float(v) for v in values_of(logarithms)))

    @property
    def values(self) -> np.ndarray:
        """(17,) in the order of NAMES."""
        return np.array([getattr(self, name) for name in NAMES])

    @property
    def logarithms(self) -> np.ndarray:
        """(17,) the coordinates of the values."""
        values = self.values
        return np.append(np.log(values[:LOGARITHMS]), values[LOGARITHMS:] / _SIZES)


def values_of(logarithms: np.ndarray) -> np.ndarray:
    """Values (..., 17) in the order of NAMES by coordinates: logarithms, places in LENGTH, forces in FORCE.

    Estimates of before know no preloads: they have 15.
    """
    known = logarithms.shape[-1] - LOGARITHMS
    values = np.zeros((*logarithms.shape[:-1], len(NAMES)))
    values[..., :LOGARITHMS] = np.exp(logarithms[..., :LOGARITHMS])
    values[..., LOGARITHMS : LOGARITHMS + known] = _SIZES[:known] * logarithms[..., LOGARITHMS:]
    return values


@dataclass(frozen=True)
class WheelSet:
    """Wheels as the stick-slip base sees them, m of them.

    Attributes:
        names: Of the wheels.
        types: `drive`, `front` or `back`.
        position: (m, 2) contact points [m, base frame].
        weight: (m,) their own [N].
        shift: (2,) how far they are from there in the base frame as its markers show it [m].
        radius: (m,) on which they roll as the base tilts [m]; (1,) 0 of estimates that do not have it.
        usual: (2,) My, -Mx under which most trials of the calibration begin [N.m].
        vertical: Stiffness of a front caster, its tyre's included [N/m]; 0 where no tilt shows it.
    """

    names: tuple[str, ...]
    types: tuple[str, ...]
    position: np.ndarray
    weight: np.ndarray
    shift: np.ndarray = field(default_factory=lambda: np.zeros(2))
    radius: np.ndarray = field(default_factory=lambda: np.zeros(1))
    usual: np.ndarray = field(default_factory=lambda: np.zeros(2))
    vertical: float = field(default_factory=lambda: 0.0)

    def __post_init__(self) -> None:
        if not len(self.names) == len(self.types) == len(self.weight):
            raise ShapeError("weight", self.weight.shape, (len(self.names),))
        if len(self.radius) not in (1, len(self.names)):
            raise ShapeError("radius", self.radius.shape, (len(self.names),))

    @property
    def mass(self) -> np.ndarray:
        """(m,) of the wheels [kg]."""
        return self.weight / STANDARD_GRAVITY

    def rows(self, p: SlipParameters) -> np.ndarray:
        """(m, 16) x, y, kx, ky, c, mu, n, G, mass, r, held, usual, kz as the kernel takes them."""
        return self.each(p.values[None])[0]

    def each(self, values: np.ndarray, places: np.ndarray | None = None) -> np.ndarray:
        """Rows (k, m, 16) by parameters (k, 17) in the order of NAMES; the wheels at places (k, m, 2) if given."""
        of = dict(zip(NAMES, values.T, strict=True))
        kx, ky = (self._typed(of[drive], of["front_k"], of["back_k"]) for drive in ("drive_kx", "drive_ky"))
        c = self._typed(of["drive_c"], of["caster_c"], of["caster_c"])
        mu = self._typed(of["drive_mu"], of["front_mu"], of["back_mu"])
        position = np.broadcast_to(self.position, (len(values), *self.position.shape)) if places is None else places
        n, G = self._loads(position, of["drive_load"], of["back_load"])
        G[..., 0] += G[..., 1] * of["load_x"][:, None] + G[..., 2] * of["load_y"][:, None]
        held = self._pushing(of["drive_held"], of["back_held"]) / kx
        kz = self.vertical * self._typed(of["drive_load"], np.ones(len(values)), of["back_load"])
        own = np.stack(np.broadcast_arrays(self.mass, self.radius, held, *self.usual, kz), axis=2)
        parts = (*(x[..., None] for x in (kx, ky, c, mu, n)), G, own)
        ahead = np.stack([of["load_x"], of["load_y"]], axis=1)[:, None]
        return np.concatenate([position + self.shift - ahead, *parts], axis=2)

    def _pushing(self, drive: np.ndarray, back: np.ndarray) -> np.ndarray:
        """Forces (k, m) along x [N] in balance, of what drives and back casters hold (k,); 0 without front casters."""
        drives, fronts, backs = (self.types.count(kind) for kind in ("drive", "front", "back"))
        if not fronts:
            return np.zeros((len(drive), len(self.types)))
        return self._typed(drive, -(drives * drive + backs * back) / fronts, back)

    def _typed(self, drive: np.ndarray, front: np.ndarray, back: np.ndarray) -> np.ndarray:
        """(k, m) of each wheel, by numbers (k,) of its type."""
        of = {"drive": drive, "front": front, "back": back}
        return np.stack([of[kind] for kind in self.types], axis=1)

    def loads(self, drive_load: float, back_load: float) -> tuple[np.ndarray, np.ndarray]:
        """n (m,) [N] and G (m, 3) of N = n + G (-Fz, My, -Mx)."""
        n, G = self._loads(self.position[None], np.array([drive_load]), np.array([back_load]))
        return n[0], G[0]

    def _loads(
        self, position: np.ndarray, drive_load: np.ndarray, back_load: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """The same, (k, m) and (k, m, 3), of wheels at places (k, m, 2)."""
        share = self._typed(drive_load, np.ones(len(drive_load)), back_load)[..., None]
        A = np.concatenate([np.ones_like(share), position], axis=2)
        across = A.transpose(0, 2, 1)
        G = share * (A @ np.linalg.pinv(across @ (share * A)))
        own = _OWN * self.weight
        return own - (G @ (across @ own)[..., None])[..., 0], G

    def standing(self, shares: np.ndarray = _ALIKE, off: np.ndarray = _IN_PLACE) -> np.ndarray:
        """(m, 10) x, y, four zeros, n and G, of wheels that share the load as springs alone do.

        Args:
            shares: (2,) of drives and back casters, relative to front casters [-].
            off: (2,) how far the place seems from which moments count [m].
        """
        placed = replace(self, position=self.position + off)
        n, G = placed.loads(*shares)
        return np.ascontiguousarray(np.column_stack([placed.position, np.zeros((len(n), 4)), n, G]))

    def tilting(self, k: np.ndarray, off: np.ndarray = _IN_PLACE) -> np.ndarray:
        """K (3, 3) of z, rx, ry by vertical springs k (3,) of drives, front and back casters [N/m, N, N.m/rad]."""
        x, y = (self.position + off).T
        a = np.stack([np.ones(len(x)), y, -x])
        return np.asarray(a * self._typed(*k[:, None])[0] @ a.T)

    def stiffness(self, p: SlipParameters) -> np.ndarray:
        """K_0 (3, 3) of x, y, yaw where every wheel sticks [N/m, N, N.m/rad]."""
        K = np.zeros((3, 3))
        for x, y, kx, ky in self.rows(p)[:, :4]:
            A = np.array([[1.0, 0.0, -y], [0.0, 1.0, x]])
            K += A.T @ np.diag([kx, ky]) @ A
        return K


@lru_cache(maxsize=8)
def wheel_set(urdf: str, wheels: tuple[Wheel, ...], gravity: float) -> WheelSet:
    """The declared wheels; their masses where the nominal robot has a joint at their hub."""
    model = pin.buildModelFromXML(urdf)
    data = model.createData()
    pin.forwardKinematics(model, data, pin.neutral(model))
    hubs = np.array([data.oMi[i].translation for i in range(1, model.njoints)])
    weights = []
    for wheel in wheels:
        near = np.flatnonzero(np.linalg.norm(hubs - np.array(wheel.centre), axis=1) < _NEAR)
        weights.append(gravity * sum(model.inertias[int(i) + 1].mass for i in near))
    position = np.array([w.contact[:2] for w in wheels])
    drives = [w.type == "drive" for w in wheels]
    axle = float(position[drives if any(drives) else slice(None), 0].mean())
    types = tuple("drive" if w.type == "drive" else "front" if w.contact[0] >= axle else "back" for w in wheels)
    radius = np.array([w.centre[2] - w.contact[2] for w in wheels])
    return WheelSet(tuple(w.name for w in wheels), types, position, np.array(weights), radius=radius)


def preloads(wheels: WheelSet, p: SlipParameters, load: np.ndarray) -> np.ndarray:
    """Deflections (PRELOADS, m, 2) [m] in which a base at rest may stand: forces that are in balance.

        f_i uniform in a disk of min(mu_i N_i, PRELOAD),     e = K^-1 (f - K A K_0^-1 sum A' f)

    What happened before a trial is not known, and is lost with the first slip: not without leaving a set. `load` (3,)
    is (-Fz, My, -Mx) at rest.
    """
    rows = wheels.rows(p)
    N = np.maximum(rows[:, 6] + rows[:, 7:10] @ load, 0.0)
    limit = np.minimum(rows[:, 5] * N, PRELOAD)
    rng = np.random.Generator(np.random.PCG64(0))
    shape = PRELOADS, len(rows)
    radius, angle = limit * np.sqrt(rng.uniform(size=shape)), rng.uniform(0.0, 2.0 * np.pi, shape)
    f = radius[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    A = np.array([[[1.0, 0.0, -y], [0.0, 1.0, x]] for x, y in wheels.position])
    shift = np.einsum("eia,iab->eb", f, A) @ np.linalg.inv(wheels.stiffness(p))
    return f / rows[:, 2:4] - np.einsum("iab,eb->eia", A, shift)
