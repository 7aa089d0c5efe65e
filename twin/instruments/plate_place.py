"""Where the force plate lies in its laboratory: shifted, raised and turned about the vertical.

    T_lab_plate = Trans(x, y, height) T_nominal R_z(yaw)

The slabs of floor around it are shifted and turned with it and stay at their height: a raised plate is a step.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from twin.config_instruments import PlatePlace
from twin.conventions import placement, transform
from twin.defects.base import Defect, Parameter, body
from twin.instruments.tiles import PLATE

_SLAB = "floor_"  # begins the name of a slab of floor


@dataclass(frozen=True)
class Laid(Defect):
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
