"""Force plates of a laboratory: one square or several, where they lie, and the robot's action on each.

    place    T_lab_plate = Trans(x, y, height) T_nominal R_z(yaw)
    grid     the square cut into columns and rows; every tile is a body on the plate's body, measured by itself
    wrench   MuJoCo sums up a plate's contacts as a force f at a point p (lab axes):   tau = tau_p + (p - c) x f

The plate's own site still measures all tiles together. The slabs of floor around the square are shifted and turned with
it and stay at their height: a raised plate is a step.
"""

from dataclasses import dataclass
from typing import Annotated

import mujoco
import numpy as np
from pydantic import Field
from pydantic.dataclasses import dataclass as validated
from scipy.spatial.transform import Rotation

from twin.defects.defect import UNTOUCHED, Defect, body
from twin.fields.values import STRICT
from twin.simulation.wrist_sensor import CARRIED, NET, sensed
from twin.transforms import placement, transform
from twin.truth import Parameter

PLATE = "plate"
"""Name of the whole square's body, shape and site."""
_SLAB = "floor_"  # begins the name of a slab of floor


@validated(frozen=True, config=STRICT)
class PlatePlace:
    """Where the plate lies against its nominal place, as surveyed: it is declared.

    Attributes:
        shift: Shift of its centre along the lab's x and y [m].
        height: Height of its surface above the floor around it [m]; the robot stands on it.
        yaw: Rotation about the vertical [rad].
    """

    shift: tuple[Annotated[float, Field(ge=-0.5, le=0.5)], Annotated[float, Field(ge=-0.5, le=0.5)]] = (0.0, 0.0)
    height: Annotated[float, Field(ge=-0.05, le=0.05)] = 0.0
    yaw: Annotated[float, Field(ge=-3.2, le=3.2)] = 0.0


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
class PlateGrid(Defect):
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


def plate_sites(model: mujoco.MjModel) -> tuple[str, ...]:
    """Sites of the tiles of a model, in order; none where there is the one plate."""
    sites = [model.site(i).name for i in range(model.nsite)]
    tiles = {name for name in sites if name.startswith(PLATE)} - {PLATE}
    return tuple(sorted(tiles, key=lambda name: int(name.removeprefix(PLATE))))


@dataclass(frozen=True)
class PlatePlacement(Defect):
    """The plate where a laboratory has it; applied after it was cut.

    Attributes:
        place: Against the nominal laboratory's.
    """

    place: PlatePlace

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Move the plate, its tiles and the floor around it; leave a plate in its nominal place alone."""
        if self.place == PlatePlace():
            return
        plate = body(spec, PLATE)
        T_new = T_lab_plate(plate, self.place)
        moved = T_new @ np.linalg.inv(transform(plate.pos, plate.quat))
        moved[2, 3] = 0.0
        for slab in (g for g in spec.geoms if g.name.startswith(_SLAB)):
            slab.pos, slab.quat = placement(moved @ transform(slab.pos, slab.quat))
        plate.pos, plate.quat = placement(T_new)

    def parameters(self) -> tuple[Parameter, ...]:
        """Where it lies, if elsewhere."""
        if self.place == PlatePlace():
            return ()
        values = zip(("x", "y", "height"), (*self.place.shift, self.place.height), strict=True)
        return (
            *(Parameter(f"plate.place.{name}", "m", value) for name, value in values),
            Parameter("plate.place.yaw", "rad", self.place.yaw),
        )


def T_lab_plate(nominal: mujoco.MjsBody, place: PlatePlace) -> np.ndarray:
    """Pose (4, 4) of a plate of the nominal laboratory that lies elsewhere."""
    T = transform(nominal.pos, nominal.quat)
    T[:3, 3] += (*place.shift, place.height)
    T[:3, :3] = T[:3, :3] @ Rotation.from_euler("z", place.yaw).as_matrix()
    return T


def plate_centre(model: mujoco.MjModel) -> np.ndarray:
    """Surface centre of the whole square in the lab (3,) [m]."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return data.site(PLATE).xpos.copy()


def plate_poses(model: mujoco.MjModel) -> np.ndarray:
    """T_lab_plate (n_plates, 4, 4) of each plate's surface centre; their axes are the same."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    centres = np.array([data.site(name).xpos for name in plate_sites(model) or (PLATE,)])
    return np.asarray(transform(centres, np.tile(model.body(PLATE).quat, (len(centres), 1))))


def add_plates(spec: mujoco.MjSpec) -> None:
    """A sensor on each body that bears a plate's site: the plate, and the parts of one that is cut in several."""
    for site in spec.sites:
        if site.name.startswith(PLATE):
            spec.add_sensor(
                name=site.name,
                type=mujoco.mjtSensor.mjSENS_CONTACT,
                objtype=mujoco.mjtObj.mjOBJ_XBODY,
                objname=site.parent.name,
                intprm=[CARRIED, NET, 1],
            )


def on_plate(model: mujoco.MjModel, sensors: np.ndarray, plate: str) -> np.ndarray:
    """Action on a plate (n, 6) of the readings of all sensors (n, ns): lab axes, about its centre [N, N.m]."""
    force, torque, point = np.split(sensed(model, sensors, (plate,)), 3, axis=1)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return -np.hstack([force, torque + np.cross(point - data.site(plate).xpos, force)])
