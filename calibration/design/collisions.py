"""Where a robot would touch itself or the floor: the collision shapes of its URDF.

Shapes of one joint's links, or of two joints next to each other, are never checked, nor are pairs that touch in four
of five postures asked about: they are joined. Markers count as small spheres on their links. Meshes are left out, since
a URDF read from a recording comes without its files. Distances below a clearance count as contact.
"""

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import coal
import numpy as np
import pinocchio as pin

from calibration.numerics.lie import inverse
from calibration.recording.schema import Description
from calibration.robot.chain import Chain

_CLEARANCE = 0.01  # [m]
_JOINED = 0.8  # share of postures in which two shapes that are joined touch
_MARKER = 0.01  # radius [m]
_ONE_POINT = 0.01  # joints closer than this are one [m]
_FLOOR = "floor"
_SLAB = 8.0  # edge of the floor [m]


@dataclass(frozen=True)
class Shapes:
    """A robot's extent.

    Attributes:
        chain: The robot; q are readings of its measured joints.
        geometry: Shapes and the pairs that are checked.
    """

    chain: Chain
    geometry: pin.GeometryModel

    @property
    def known(self) -> bool:
        """Whether the URDF has any shape at all."""
        return any(not o.name.startswith(("marker:", _FLOOR)) for o in self.geometry.geometryObjects)

    @cached_property
    def _work(self) -> tuple[pin.Data, pin.GeometryData]:
        """Where Pinocchio keeps poses and contacts; each query overwrites them."""
        return self.chain.nominal.createData(), _requests(self.geometry)

    def collides(self, q: np.ndarray) -> np.ndarray:
        """(n,) whether the robot touches itself or the floor at q (n, n_measured)."""
        model, geometry, (data, shapes) = self.chain.nominal, self.geometry, self._work
        return np.array(
            [pin.computeCollisions(model, data, geometry, shapes, row, True) for row in self.chain.configurations(q)],
            dtype=bool,
        )

    def parted(self, q: np.ndarray) -> "Shapes":
        """Without the pairs that touch in nearly all of q (n, n_measured): they are joined."""
        model, geometry, (data, shapes) = self.chain.nominal, self.geometry, self._work
        often = np.zeros(len(geometry.collisionPairs))
        for row in self.chain.configurations(q):
            pin.computeCollisions(model, data, geometry, shapes, row, False)
            often += [r.isCollision() for r in shapes.collisionResults]
        kept = geometry.copy()
        for k in np.flatnonzero(often > _JOINED * len(q)):
            kept.removeCollisionPair(geometry.collisionPairs[int(k)])
        return Shapes(self.chain, kept)

    def boxes(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Boxes around the shapes, markers and floor apart: poses (n, m, 4, 4) in the base frame and half edges (m, 3).

        q is (n, n_measured).
        """
        model, data = self.chain.nominal, self.chain.nominal.createData()
        chosen = [o for o in self.geometry.geometryObjects if not o.name.startswith(("marker:", _FLOOR))]
        half, centre = _extents([o.geometry for o in chosen])
        joints = np.empty((len(q), model.njoints, 4, 4))
        for k, row in enumerate(self.chain.configurations(q)):
            pin.forwardKinematics(model, data, row)
            joints[k] = [M.homogeneous for M in data.oMi]
        base = inverse(model.frames[model.getFrameId(self.chain.base_frame)].placement.homogeneous)
        fixed = np.array([(o.placement * c).homogeneous for o, c in zip(chosen, centre, strict=True)])
        at = [o.parentJoint for o in chosen]
        return base @ joints[:, at] @ fixed.reshape(-1, 4, 4), half


def _requests(geometry: pin.GeometryModel) -> pin.GeometryData:
    """Asks for contact within the clearance."""
    data = geometry.createData()
    for request in data.collisionRequests:
        request.security_margin = _CLEARANCE
    return data


def _extents(shapes: list[coal.CollisionGeometry]) -> tuple[np.ndarray, list[pin.SE3]]:
    """Half edges (m, 3) and centres of the boxes around shapes, in the shapes' own frames."""
    for shape in shapes:
        shape.computeLocalAABB()
    boxes = [shape.aabb_local for shape in shapes]
    half = np.array([0.5 * (b.max_ - b.min_) for b in boxes]).reshape(-1, 3)
    return half, [pin.SE3(np.eye(3), 0.5 * (b.max_ + b.min_)) for b in boxes]


def shapes_of(urdf: str, chain: Chain, description: Description) -> Shapes:
    """Shapes of the nominal robot of a dataset, its markers on it and the floor its wheels stand on."""
    full = pin.buildModelFromXML(urdf)
    drawn = pin.buildGeomFromUrdfString(full, _without_meshes(urdf), pin.GeometryType.COLLISION)
    locked = [full.getJointId(n) for n in full.names if n not in {"universe", *chain.measured}]
    model, geometry = pin.buildReducedModel(full, drawn, locked, pin.neutral(full))
    for body in description.bodies:
        frame = model.frames[model.getFrameId(body.link)]
        for marker in body.markers:
            place = frame.placement * pin.SE3(np.eye(3), np.array(marker.xyz))
            geometry.addGeometryObject(_object(f"marker:{marker.name}", frame.parentJoint, place, coal.Sphere(_MARKER)))
    if description.wheels:
        base = model.frames[model.getFrameId(description.base_frame)].placement
        z = min(w.contact[2] for w in description.wheels)
        place = base * pin.SE3(np.eye(3), np.array([0.0, 0.0, z - 0.5]))
        geometry.addGeometryObject(_object(_FLOOR, 0, place, coal.Box(_SLAB, _SLAB, 1.0)))
    for i, j in combinations(range(geometry.ngeoms), 2):
        if _checked(model, geometry.geometryObjects[i], geometry.geometryObjects[j]):
            geometry.addCollisionPair(pin.CollisionPair(i, j))
    return Shapes(chain, geometry)


def _checked(model: pin.Model, a: pin.GeometryObject, b: pin.GeometryObject) -> bool:
    """Whether two shapes could meet: on joints that are not next to each other, joints at one point taken as one."""
    i, j = sorted((a.parentJoint, b.parentJoint))
    if i == j:
        return False
    above = int(model.parents[j])
    while above not in (i, 0) and np.linalg.norm(model.jointPlacements[j].translation) < _ONE_POINT:
        j, above = above, int(model.parents[above])
    return above != i


def _object(name: str, joint: int, placement: pin.SE3, shape: coal.CollisionGeometry) -> pin.GeometryObject:
    return pin.GeometryObject(name, joint, placement, shape)


def _without_meshes(urdf: str) -> str:
    """The URDF without shapes that stand in other files."""
    robot = ET.fromstring(urdf)
    for link in robot.findall("link"):
        for kind in ("collision", "visual"):
            for element in link.findall(kind):
                if kind == "visual" or element.find("geometry/mesh") is not None:
                    link.remove(element)
    return ET.tostring(robot, encoding="unicode")
