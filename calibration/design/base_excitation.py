"""Motions that show how the base's wheels stick and slip: recorded beside the campaign's swings.

    q(t) = q_0 + A (1 - cos 2 pi f s(t)) / 2,     ds/dt a ramp of RAMP seconds to 1, as abrupt as the robot allows

from an admissible posture q_0 towards another, q_0 + A, and back; a lift, which is slow, stays. At 0.25 of the highest
speed wheels stick, which shows their springs; at all of it they slide, which shows their frictions. Of the candidates
those are chosen in turn that leave least volume of the stick-slip parameters,

    max  sum_f log det(S^-2 + sum_k H_k(f)),     H_k of `likelihood.Trials.normal` where markers show what is predicted

over some frictions f that the wheels may have: which of them is not known before. The wrench is that of the nominal
robot's inverse dynamics, heave and tilt left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibration.design.candidates import Room, room_of
from calibration.design.collisions import shapes_of
from calibration.errors import NotEnoughData
from calibration.numerics.signals import RATE
from calibration.recording.schema import Description
from calibration.recording.trial import REST
from calibration.robot.laboratory import Laboratory
from calibration.stages.stick_slip.forcing import PlanarForcing, Readings, Tilting, planar_forcing, wrenches_along
from calibration.stages.stick_slip.likelihood import joined
from calibration.stages.stick_slip.measured import BLOCK, PlanarMotion, blocks
from calibration.stages.stick_slip.wheels import LOGARITHMS, NAMES, PRIOR, PRIOR_SIGMA, WheelSet, wheel_set

SECONDS, RAMP = 10.0, 0.12
_CANDIDATES = 400  # a tenth of them shows less than the campaign's swings, by the draw
_HERTZ = (0.2, 0.4)
_SPEEDS = (0.25, 1.0)  # shares of the highest speed
_FASTEST = 1.2  # [rad/s]
_PROBES = 12  # postures along a motion that are asked for contacts
_FRICTIONS = (0.0, -0.5)  # logarithms over the prior's
_STIFF = 1e9  # [N/m, N.m/rad] of heave and tilt


@dataclass(frozen=True)
class BaseMotion:
    """A motion to record.

    Attributes:
        t: (n,) [s].
        q: (n, n_joints) [rad, m].
        slides: Share of the time in which a wheel slides [-], by the prior's parameters.
    """

    t: np.ndarray
    q: np.ndarray
    slides: float


@dataclass(frozen=True)
class BasePlan:
    """Chosen motions.

    Attributes:
        joints: Columns of the motions.
        motions: In the order in which they were chosen.
        names: Of the stick-slip parameters, p of them.
        sigma: (p,) standard deviations of their logarithms after the motions, mean over the frictions.
    """

    joints: tuple[str, ...]
    motions: tuple[BaseMotion, ...]
    names: tuple[str, ...]
    sigma: np.ndarray


@dataclass(frozen=True)
class Excitation:
    """What motions of one robot show of its wheels.

    Attributes:
        lab: The nominal robot.
        wheels: Its wheels.
        noise: (3,) of x, y, yaw, see `PlanarMotion`.
    """

    lab: Laboratory
    wheels: WheelSet
    noise: np.ndarray

    @classmethod
    def of(cls, lab: Laboratory) -> "Excitation":
        """Of a laboratory.

        Raises:
            NotEnoughData: It declares no wheels.
        """
        description = lab.description
        if not description.wheels:
            raise NotEnoughData("dataset.json declares no wheels: there is no base that slips")
        xy = np.array([m.xyz for m in description.base_body.markers])[:, :2]
        s = description.sigmas.marker / np.sqrt(BLOCK * len(xy))
        noise = np.array([s, s, s / np.sqrt(((xy - xy.mean(axis=0)) ** 2).sum(axis=1).mean())])
        gravity = float(np.linalg.norm(description.gravity))
        return cls(lab, wheel_set(lab.urdf, description.wheels, gravity), noise)

    def information(self, t: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, float]:
        """H (f, p, p) by each of the frictions, and the share of the time in which a wheel slides.

        Args:
            t: (n,) [s].
            q: (n, n_joints) [rad, m].
        """
        stiff = Tilting(np.diag(np.full(6, _STIFF)), np.diag(np.full(6, _STIFF / RATE)))
        forcing = planar_forcing(wrenches_along(self.lab, Readings(t, q), None, np.eye(4)), stiff, "dynamics")
        found, slides = [], 0.0
        for offset in _FRICTIONS:
            p = PRIOR + offset * np.array([name.endswith("_mu") for name in NAMES])
            H, share = self._shown(forcing, p)
            found.append(H)
            slides = max(slides, share)
        return np.array(found), slides

    def _shown(self, forcing: PlanarForcing, p: np.ndarray) -> tuple[np.ndarray, float]:
        blank = PlanarMotion(np.zeros((len(forcing.t) // BLOCK, 3)), np.ones(len(forcing.t) // BLOCK, bool), self.noise)
        x, share = joined(self.wheels, [(forcing, blank)]).simulated(p[None])
        seen = joined(self.wheels, [(forcing, PlanarMotion(blocks(x[0]), blank.valid, self.noise))])
        (H,), _ = seen.normal(p, seen.errors(p[None])[0])
        return H, float((share[0] > 0.0).mean())


def base_motions(urdf: str, description: Description, n: int, rng: np.random.Generator) -> BasePlan:
    """n motions, of SECONDS each, that show the stick-slip parameters of a robot's wheels best.

    Raises:
        NotEnoughData: It declares no wheels, or has hardly any posture clear of itself and in sight.
    """
    lab = Laboratory(urdf, description)
    excitation = Excitation.of(lab)
    room = room_of(shapes_of(urdf, lab.chain, description), description, rng)
    motions = list(_candidates(room, rng))
    shown = [excitation.information(*motion) for motion in motions]
    H = np.array([each for each, _ in shown])
    chosen, total = chosen_in_turn(H, n)
    sigma = np.sqrt(np.mean([np.diag(np.linalg.inv(each)) for each in total], axis=0))
    picked = tuple(BaseMotion(*motions[k], shown[k][1]) for k in chosen)
    return BasePlan(tuple(description.joint_names), picked, NAMES[:LOGARITHMS], sigma[:LOGARITHMS])


def chosen_in_turn(H: np.ndarray, n: int) -> tuple[list[int], np.ndarray]:
    """Which of information H (m, f, p, p), one after the other, and all of them with the prior's (f, p, p)."""
    total = np.repeat(np.diag(PRIOR_SIGMA**-2.0)[None], H.shape[1], axis=0)
    chosen: list[int] = []
    for _ in range(min(n, len(H))):
        gain = np.linalg.slogdet(total + H)[1].sum(axis=1)
        gain[chosen] = -np.inf
        chosen.append(int(gain.argmax()))
        total = total + H[chosen[-1]]
    return chosen, total


def _candidates(room: Room, rng: np.random.Generator) -> Sequence[tuple[np.ndarray, np.ndarray]]:
    """Times (n,) and positions (n, n_joints) of motions clear of the robot."""
    t = np.arange(round((SECONDS + 2.0 * REST) * RATE)) / RATE
    s = np.clip(t - 1.5 * REST, 0.0, SECONDS - REST)
    s = np.where(s < RAMP, 0.5 * s**2 / RAMP, s - 0.5 * RAMP)
    chain, found = room.shapes.chain, []
    lift, ends = np.array([chain.is_prismatic(j) for j in chain.measured]), room.pool(2 * _CANDIDATES, rng)
    for k, (a, b) in enumerate(zip(ends[::2], ends[1::2], strict=True)):
        f, b = _HERTZ[k % 2], np.where(lift, a, b)
        share = _SPEEDS[k // 2 % 2] * _FASTEST / (np.pi * f * float(np.abs(b - a).max()))
        q = a + min(share, 1.0) * 0.5 * (1.0 - np.cos(2.0 * np.pi * f * s))[:, None] * (b - a)
        along = a + np.linspace(0.0, min(share, 1.0), _PROBES)[:, None] * (b - a)
        if not (room.shapes.known and room.shapes.collides(along).any()):
            found.append((t, q))
    return found
