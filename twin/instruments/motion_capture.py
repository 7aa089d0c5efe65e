"""Motion capture: marker positions in the lab with white noise per axis, and what it gets wrong beside.

    p = T_lab_link T_link_body p_m                          of marker m
    y(p) = (1 + scale) p + A sum_k a_k cos(w_k . p + phi_k) / sqrt(K / 2) + n      |w_k| about 1 / bias_length
    lost   a marker that fewer than two cameras see past the arm, a chain of capsules from shoulder to hand
    swapped   two markers of a body exchange labels for a while

Amplitudes: volume errors of 0.15-0.3 mm and scale 1e-4 are typical (Merriaux et al., Sensors 2017). n: white noise.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field
from pydantic.dataclasses import dataclass as validated

from twin.defects.defect import Defect
from twin.fields.distributions import DRAWN
from twin.fields.values import STRICT, FixedNonNegative, FixedPositive, NonNegative, Vector3
from twin.instruments.clock import Clock, latency
from twin.instruments.instrument import Channels, Instrument, Streams, Timing
from twin.instruments.markers import Cluster, LooseMarker
from twin.instruments.sampling import interpolate, interpolate_poses, windows, within
from twin.simulation.states import States
from twin.truth import Parameter

ARM = ("arm_2_link", "arm_4_link", "arm_6_link", "gripper_grasping_frame")
"""Links whose origins are joined by the capsules that hide markers."""
Small = Annotated[float, Field(ge=-0.05, le=0.05), DRAWN]
_WAVES = 8
_LEAST = 2  # cameras that must see a marker


@validated(frozen=True, config=STRICT)
class MocapErrors:
    """Of the motion capture.

    Attributes:
        scale: Relative error of all lengths [-].
        bias: Standard deviation of a smooth field of position errors, per axis [m].
        bias_length: Length over which that field changes [m].
        latency: Delay from exposure to time stamp [s].
        cameras: Positions of the cameras [m]; a marker that fewer than two see past the arm is lost. None: all is seen.
        arm_radius: Radius of the arm where it hides markers [m].
        swaps: How often two markers of a body exchange labels [1/min].
        swap_duration: Duration of each exchange [s].
    """

    scale: Small = 0.0
    bias: NonNegative = 0.0
    bias_length: FixedPositive = 1.5
    latency: NonNegative = 0.0
    cameras: tuple[Vector3, ...] = ()
    arm_radius: FixedPositive = 0.06
    swaps: FixedNonNegative = 0.0
    swap_duration: FixedPositive = 0.3


@dataclass(frozen=True)
class Volume(Defect):
    """Scale error and slow spatial bias of one calibrated volume.

    Attributes:
        scale: [-].
        amplitude: A: standard deviation of the field per axis [m].
        waves: w_k (k, 3) [rad/m].
        phases: phi_k (k, 3) by axis [rad].
    """

    scale: float
    amplitude: float
    waves: np.ndarray
    phases: np.ndarray

    def distorted(self, p: np.ndarray) -> np.ndarray:
        """Positions (..., 3) [m, lab] as this volume shows them."""
        if self.scale == 0.0 and self.amplitude == 0.0:
            return p
        field = np.cos((p @ self.waves.T)[..., None] + self.phases).sum(axis=-2) / np.sqrt(0.5 * len(self.waves))
        return (1.0 + self.scale) * p + self.amplitude * field

    def parameters(self) -> tuple[Parameter, ...]:
        """Scale and the field's size, where they are not zero."""
        named = (("scale", "-", self.scale), ("bias", "m", self.amplitude))
        return tuple(Parameter(f"mocap.{n}", unit, v) for n, unit, v in named if v != 0.0)


def volume(errors: MocapErrors, rng: np.random.Generator) -> Volume:
    """One calibrated volume: waves in random directions."""
    waves = rng.normal(size=(_WAVES, 3)) / errors.bias_length
    return Volume(errors.scale, errors.bias, waves, rng.uniform(0.0, 2.0 * np.pi, (_WAVES, 3)))


def hidden(p: np.ndarray, arm: np.ndarray, errors: MocapErrors) -> np.ndarray:
    """Whether fewer than two cameras see each marker (n, m) at p (n, m, 3), past the arm (n, 4, 3) [m, lab]."""
    seen = np.zeros(p.shape[:2], dtype=int)
    for camera in np.array(errors.cameras):
        blocked = np.zeros(p.shape[:2], dtype=bool)
        for a, b in zip(arm.swapaxes(0, 1)[:-1], arm.swapaxes(0, 1)[1:], strict=True):
            blocked |= segment_distance(camera, p, a[:, None], b[:, None]) < errors.arm_radius
        seen += ~blocked
    return seen < _LEAST


def segment_distance(p: np.ndarray, q: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Least distance (...) between segments p-q and a-b, arrays (..., 3) that broadcast; none is a point.

    Reference: Ericson, Real-Time Collision Detection, 2005, ch. 5.1.9.
    """
    d, e, r = q - p, b - a, p - a
    dd, ee, de = (d * d).sum(-1), (e * e).sum(-1), (d * e).sum(-1)
    dr, er = (d * r).sum(-1), (e * r).sum(-1)
    s = np.clip((de * er - dr * ee) / np.maximum(dd * ee - de**2, 1e-12), 0.0, 1.0)
    t = (de * s + er) / ee
    s = np.where((t < 0.0) | (t > 1.0), np.clip((de * np.clip(t, 0.0, 1.0) - dr) / dd, 0.0, 1.0), s)
    t = np.clip(t, 0.0, 1.0)
    return np.linalg.norm(r + s[..., None] * d - t[..., None] * e, axis=-1)


def relabelled(
    t: np.ndarray, p: np.ndarray, body: tuple[str, ...], errors: MocapErrors, rng: np.random.Generator
) -> np.ndarray:
    """Positions (n, m, 3) at t (n,) [s] in which, now and then, two markers of a body have each other's label."""
    p = p.copy()
    for span in windows(t, errors.swaps, errors.swap_duration, rng):
        rows = np.flatnonzero(within(t, span[None]))
        of = np.flatnonzero(np.array(body) == rng.choice(sorted(set(body))))
        pair = rng.choice(of, 2, replace=False)
        p[np.ix_(rows, pair)] = p[np.ix_(rows, pair[::-1])]
    return p


def marker_positions(T_lab_link: np.ndarray, cluster: Cluster) -> np.ndarray:
    """True positions (n, n_markers, 3) [m, lab] of a cluster's markers along poses of its link (n, 4, 4)."""
    T = T_lab_link @ cluster.T_link_body
    return np.einsum("nij,kj->nki", T[:, :3, :3], cluster.nominal + cluster.shift) + T[:, None, :3, 3]


def measured(positions: np.ndarray, sigma: float, rng: np.random.Generator) -> np.ndarray:
    """Positions with white noise of sigma [m] per axis."""
    return positions + sigma * rng.normal(size=positions.shape)


@dataclass(frozen=True)
class MotionCapture(Instrument):
    """The motion capture of one laboratory and the markers it sees.

    Attributes:
        clusters: Marker bodies.
        loose: Markers that hang.
        volume: Its calibrated volume.
        errors: What else it gets wrong.
        noise: Per axis [m].
        rate: [Hz].
    """

    clusters: tuple[Cluster, ...]
    loose: tuple[LooseMarker, ...]
    volume: Volume
    errors: MocapErrors
    noise: float
    rate: float
    of_force = False

    @property
    def markers(self) -> tuple[str, ...]:
        """Names of all markers."""
        return tuple(m for c in self.clusters for m in c.marker_names)

    def true_positions(self, poses: dict[str, np.ndarray], t: np.ndarray) -> np.ndarray:
        """Positions (n, n_markers, 3) [m, lab] from poses of links (n, 4, 4) at t (n,) [s from the epoch]."""
        p = np.concatenate([marker_positions(poses[c.link], c) for c in self.clusters], axis=1)
        for marker in self.loose:
            p = marker.moved(t, self.markers, p)
        return p

    def measure(self, states: States, timing: Timing, streams: Streams) -> Channels:
        """Positions (n, n_markers, 3), NaN where hidden."""
        late, body = self.errors.latency, tuple(c.name for c in self.clusters for _ in c.marker_names)
        stamps, _ = Clock("mocap").ticks(timing.start + late, timing.stop + late, self.rate)
        t = stamps - late - timing.start
        poses = {c.link: interpolate_poses(t, states.t, states.poses[c.link]) for c in self.clusters}
        true = self.true_positions(poses, stamps - late - timing.epoch)
        seen = measured(self.volume.distorted(true), self.noise, streams("mocap"))
        if self.errors.cameras:
            arm = np.stack([interpolate(t, states.t, states.poses[link][:, :3, 3]) for link in ARM], axis=1)
            seen[hidden(true, arm, self.errors)] = np.nan
        seen = relabelled(stamps, seen, body, self.errors, streams("labels"))
        return {"marker": self.markers, "marker_body": body, "t_mocap": stamps, "marker_position": seen}

    def parameters(self) -> tuple[Parameter, ...]:
        """Of the markers, the volume and the cameras; what is off unless a scenario names it, where it is on."""
        e = self.errors
        found = [("noise", "m", self.noise), ("swaps", "1/min", e.swaps)]
        found += [("bias_length", "m", e.bias_length)] if e.bias else []
        found += [("swap_duration", "s", e.swap_duration)] if e.swaps else []
        found += [("arm_radius", "m", e.arm_radius)] if e.cameras else []
        for k, camera in enumerate(e.cameras, 1):
            found += [(f"camera_{k}.{axis}", "m", x) for axis, x in zip("xyz", camera, strict=True)]
        return (
            *(p for source in (*self.clusters, *self.loose, self.volume) for p in source.parameters()),
            *latency("mocap", e.latency),
            *(Parameter(f"mocap.{n}", unit, value) for n, unit, value in found if value or n.startswith("camera")),
        )
