"""What a scenario may add that no model of the calibration contains; each is off unless it is named. SI units."""

from collections.abc import Iterator
from dataclasses import field
from typing import Annotated

from pydantic.dataclasses import dataclass

from twin.defects.bending import Cable, Flexibility
from twin.defects.defect import Defect
from twin.defects.floor_tilt import FloorTilt, Tilt
from twin.defects.thermal_drift import ThermalDrift
from twin.fields.names import ArmLinkName, ArmName, JointName
from twin.fields.values import BY_NAME, STRICT, Keyed
from twin.instruments.markers import LooseMarker


@dataclass(frozen=True, config=STRICT)
class Departures:
    """Disturbances by the part they concern; `twin.defects` lists any defect.

    Attributes:
        bending: By link of the arm; the column bends as `torso` says.
        warming: By joint of the torso or the arm.
        floor_tilt: Rotation of the floor, and of the lab's axes with it, out of level about x and y [rad].
        cables: By joint of the arm.
        loosened: By marker.
    """

    bending: Annotated[dict[ArmLinkName, Flexibility], Keyed("link"), BY_NAME] = field(default_factory=dict)
    warming: Annotated[dict[JointName, ThermalDrift], Keyed("joint_name"), BY_NAME] = field(default_factory=dict)
    floor_tilt: tuple[Tilt, Tilt] = (0.0, 0.0)
    cables: Annotated[dict[ArmName, Cable], Keyed("joint_name"), BY_NAME] = field(default_factory=dict)
    loosened: Annotated[dict[str, LooseMarker], Keyed("name"), BY_NAME] = field(default_factory=dict)

    def defects(self) -> Iterator[Defect]:
        """Those that change the robot or its floor."""
        yield from self.bending.values()
        yield from self.warming.values()
        if any(self.floor_tilt):
            yield FloorTilt(self.floor_tilt)
        yield from self.cables.values()
