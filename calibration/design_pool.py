"""Postures to choose from: inside the joints' limits, clear of the robot itself, base and hand in the cameras' sight.

Drawn uniformly in the joints' ranges, a margin inside the limits, and kept where all of that holds. A continuous joint
is drawn from one turn.
"""

from dataclasses import dataclass

import numpy as np

from calibration.errors import NotEnoughData
from calibration.parameters import METRES_PER_RAD
from calibration.schema import Description
from calibration.shapes import Shapes
from calibration.sight import in_sight

MARGIN = 0.1  # inside the limits [rad, a tenth of it in m]
_BATCH = 400
_BATCHES = 40
_PROBES = 60  # postures asked which shapes are joined


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
    low, high = (np.where(np.isfinite(x), x, s * np.pi) for x, s in zip(chain.limits(), (-1, 1), strict=True))
    margin = np.array([MARGIN * (METRES_PER_RAD if chain.is_prismatic(j) else 1.0) for j in chain.measured])
    margin = np.where(np.isin(np.arange(len(low)), chain.columns), np.minimum(margin, 0.25 * (high - low)), np.inf)
    middle = 0.5 * (low + high)
    low, high = np.minimum(low + margin, middle), np.maximum(high - margin, middle)
    whole = Room(shapes, description, low, high)
    return Room(shapes.parted(whole.sample(_PROBES, rng)), description, low, high)
