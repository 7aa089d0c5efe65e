"""Postures to choose from: inside the joints' limits, clear of the robot itself, base and hand in the cameras' sight.

Drawn uniformly in the joints' ranges, a margin inside the limits, and kept where all of that holds. A continuous joint
is sampled from one turn.

Which markers cameras would see, the robot's own shapes in the way.

A ring of cameras looks at the robot from around and above. A marker is seen by a camera where no box around a shape
cuts the line between them, from a few centimetres off the marker on; a body is seen where three of its markers are, by
two cameras each. Boxes are larger than what is in them: who is seen here is seen there.
"""

from dataclasses import dataclass

import numpy as np

from calibration.design.collisions import Shapes
from calibration.errors import NotEnoughData
from calibration.recording.schema import Body, Description
from calibration.robot.nominal_frames import METRES_PER_RAD

MARGIN = 0.1  # inside the limits [rad, a tenth of it in m]
_BATCH = 400
_BATCHES = 40
_PROBES = 60  # postures asked which shapes are joined
_CAMERAS, _RADIUS, _HEIGHT = 8, 3.0, 2.4  # a ring about the base [m]
_OFF = 0.03  # of the marker, where the line begins [m]
_FEWEST_CAMERAS, _FEWEST_MARKERS = 2, 3
_PARALLEL = 1e-9  # [m] along a box's axis, of a line that runs along its side
_CHUNK = 64


@dataclass(frozen=True)
class Room:
    """Where postures may be.

    Attributes:
        shapes: The robot's extent, pairs that are joined left out.
        description: Its markers.
        low: (n_measured,) least and
        high: (n_measured,) largest positions [rad, m].
    """

    shapes: Shapes
    description: Description
    low: np.ndarray
    high: np.ndarray

    def sample(self, n: int, rng: np.random.Generator) -> np.ndarray:
        """So many postures inside the limits, in contact or not."""
        return rng.uniform(self.low, self.high, size=(n, len(self.low)))

    def admits(self, q: np.ndarray) -> np.ndarray:
        """Those of q (n, n_measured) that are clear of the robot and in sight."""
        q = q[~self.shapes.collides(q)] if self.shapes.known else q
        return q[in_sight(self.shapes, self.description, q)]

    def pool(self, n: int, rng: np.random.Generator) -> np.ndarray:
        """Postures (n, n_measured), uniform over the room.

        Raises:
            NotEnoughData: There are hardly any.
        """
        found = np.zeros((0, len(self.low)))
        for _ in range(_BATCHES):
            found = np.concatenate([found, self.admits(self.sample(_BATCH, rng))])
            if len(found) >= n:
                return found[:n]
        raise NotEnoughData(
            f"{len(found)} of {_BATCH * _BATCHES} postures are inside the limits, clear of the robot and seen by the "
            f"cameras; {n} are needed: are the limits and shapes of the URDF right?"
        )

    def near(self, q: np.ndarray, n: int, width: float, rng: np.random.Generator) -> np.ndarray:
        """Admissible ones of n postures about each of q (m, n_measured), `width` of each joint's range away."""
        step = width * (self.high - self.low) * rng.normal(size=(n, *q.shape))
        return self.admits(np.clip(q + step, self.low, self.high).reshape(-1, len(self.low)))


def room_of(shapes: Shapes, description: Description, rng: np.random.Generator) -> Room:
    """Inside the limits by a margin; measured joints that carry nothing of the chain stay in their middle."""
    chain = shapes.chain
    low, high = (np.where(np.isfinite(x), x, s * np.pi) for x, s in zip(chain.limits, (-1, 1), strict=True))
    margin = np.array([MARGIN * (METRES_PER_RAD if chain.is_prismatic(j) else 1.0) for j in chain.measured])
    margin = np.where(np.isin(np.arange(len(low)), chain.columns), np.minimum(margin, 0.25 * (high - low)), np.inf)
    middle = 0.5 * (low + high)
    low, high = np.minimum(low + margin, middle), np.maximum(high - margin, middle)
    whole = Room(shapes, description, low, high)
    return Room(shapes.parted(whole.sample(_PROBES, rng)), description, low, high)


def ring() -> np.ndarray:
    """Camera positions (c, 3) in the base frame [m]."""
    angle = 2.0 * np.pi * (np.arange(_CAMERAS) + 0.5) / _CAMERAS
    return np.column_stack([_RADIUS * np.cos(angle), _RADIUS * np.sin(angle), np.full(_CAMERAS, _HEIGHT)])


def in_sight(shapes: Shapes, description: Description, q: np.ndarray, cameras: np.ndarray | None = None) -> np.ndarray:
    """(n,) whether base and hand bodies are seen at q (n, n_measured) by cameras (c, 3) in the base frame."""
    eyes, found = ring() if cameras is None else cameras, []
    for k in range(0, len(q), _CHUNK):
        part = q[k : k + _CHUNK]
        T, half = shapes.boxes(part)
        seen = np.ones(len(part), dtype=bool)
        for body in (b for b in (description.base_body, description.hand_body) if b.markers):
            count = (visible(markers_at(shapes, body, part), eyes, T, half).sum(axis=2) >= _FEWEST_CAMERAS).sum(axis=1)
            seen &= count >= min(_FEWEST_MARKERS, len(body.markers))
        found.append(seen)
    return np.concatenate(found) if found else np.zeros(0, dtype=bool)


def markers_at(shapes: Shapes, body: Body, q: np.ndarray) -> np.ndarray:
    """Nominal markers (n, m, 3) of a body in the base frame [m]."""
    T, xyz = shapes.chain.poses(q, body.link), np.array([m.xyz for m in body.markers])
    return np.asarray(xyz @ np.swapaxes(T[:, :3, :3], 1, 2) + T[:, None, :3, 3])


def visible(points: np.ndarray, cameras: np.ndarray, T: np.ndarray, half: np.ndarray) -> np.ndarray:
    """(n, m, c) whether nothing is between points (n, m, 3) and cameras (c, 3): boxes T (n, b, 4, 4), half (b, 3)."""
    n, m, c = len(points), points.shape[1], len(cameras)
    ray = (cameras - points[:, :, None]).reshape(n, m * c, 3)
    length = np.linalg.norm(ray, axis=2, keepdims=True)
    start = np.repeat(points, c, axis=1) + _OFF * ray / length
    R = T[:, :, :3, :3]
    o = start[:, None] @ R - (np.swapaxes(T[:, :, :3, 3:], 2, 3) @ R)
    d = (ray * (1.0 - _OFF / length))[:, None] @ R
    enter, leave = np.full(o.shape[:3], 0.0), np.full(o.shape[:3], 1.0)
    for i in range(3):
        slope = 1.0 / np.where(np.abs(d[..., i]) < _PARALLEL, _PARALLEL, d[..., i])
        middle, reach = -o[..., i] * slope, half[:, i, None] * np.abs(slope)
        np.maximum(enter, middle - reach, out=enter)
        np.minimum(leave, middle + reach, out=leave)
    return np.asarray(~(enter <= leave).any(axis=1)).reshape(n, m, c)
