"""Several force plates where the nominal laboratory has one: its square cut into columns and rows, each felt apart.

Every tile is a body of its own on the plate's body, whose site still feels them all together.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from twin.defects.base import UNTOUCHED, Defect, body

PLATE = "plate"
"""Name of the whole square's body, shape and site."""


@dataclass(frozen=True)
class Tile:
    """One plate.

    Attributes:
        name: Its name.
        shift: Its surface centre from the whole square's (2,) [m].
        size: Lengths of its edges along x and y [m].
    """

    name: str
    shift: tuple[float, float]
    size: tuple[float, float]


@dataclass(frozen=True)
class Tiles(Defect):
    """Plates in columns along x and rows along y.

    Attributes:
        grid: Their numbers; (1, 1) is the one plate of the nominal laboratory.
    """

    grid: tuple[int, int]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the plates: along x first, then along y."""
        n = self.grid[0] * self.grid[1]
        return (PLATE,) if n == 1 else tuple(f"{PLATE}{k + 1}" for k in range(n))

    def cut(self, width: float, depth: float) -> tuple[Tile, ...]:
        """The plates of a square of edges [m] along x and y."""
        (m, n), whole = self.grid, np.array([width, depth])
        size = whole / self.grid
        corners = (np.array([i, j]) * size for j in range(n) for i in range(m))
        shifts = [corner + 0.5 * size - 0.5 * whole for corner in corners]
        return tuple(
            Tile(name, (float(s[0]), float(s[1])), (float(size[0]), float(size[1])))
            for name, s in zip(self.names, shifts, strict=True)
        )

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Put the tiles in place of the plate's shape, which then touches nothing; leave one plate alone."""
        if self.grid == (1, 1):
            return
        whole, plate = spec.geom(PLATE), body(spec, PLATE)
        width, depth = 2.0 * whole.size[:2]
        for tile in self.cut(float(width), float(depth)):
            own = plate.add_body(name=tile.name, pos=[*tile.shift, 0.0])
            shape = own.add_geom(type=whole.type, size=[*np.array(tile.size) / 2.0, whole.size[2]], pos=whole.pos)
            shape.contype, shape.conaffinity, shape.mass = whole.contype, whole.conaffinity, 0.0
            shape.rgba, shape.group = whole.rgba, whole.group
            own.add_site(name=tile.name)
        whole.contype, whole.conaffinity = UNTOUCHED


def felt(model: mujoco.MjModel) -> tuple[str, ...]:
    """Sites of the tiles of a model, in order; none where there is the one plate."""
    sites = [model.site(i).name for i in range(model.nsite)]
    tiles = {name for name in sites if name.startswith(PLATE)} - {PLATE}
    return tuple(sorted(tiles, key=lambda name: int(name.removeprefix(PLATE))))
