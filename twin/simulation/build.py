"""From a nominal specification and defects to a compiled twin that knows its own truth."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from twin.defects.defect import Defect, body
from twin.fields.names import HAND
from twin.simulation import wrist_sensor
from twin.simulation.force_plates import add_plates
from twin.truth import Parameter

_POSES = (mujoco.mjtSensor.mjSENS_FRAMEPOS, mujoco.mjtSensor.mjSENS_FRAMEQUAT)
PUSH = ("push.x", "push.y", "push.z")
_HELD = ("wheel", "caster", "head", "gripper")


@dataclass(frozen=True)
class Twin:
    """A robot whose truth is known.

    Attributes:
        model: The compiled model; what it holds is what `simulate` integrates.
        truth: Every parameter of every defect.
        links: Links whose poses are sensed, in the order of the sensors.
    """

    model: mujoco.MjModel
    truth: tuple[Parameter, ...]
    links: tuple[str, ...]


def build(
    spec: mujoco.MjSpec,
    defects: Sequence[Defect],
    links: Sequence[str] = (),
    timestep: float = 0.001,
    visual: bool = False,
) -> Twin:
    """Compile a twin; the specification given is left as it was.

    Args:
        spec: The nominal robot on its floor.
        defects: Applied in this order.
        links: Links whose poses are to be sensed.
        timestep: [s].
        visual: Keep the shapes, for a picture.

    Raises:
        UnknownElement: A defect or a link names what the robot does not have.
    """
    spec = spec.copy()
    _strip(spec, visual)
    _solver(spec, timestep)
    for defect in defects:
        defect.apply(spec)
    _brake(spec)
    _sense(spec, links)
    _push(spec)
    if not visual:
        _fuse(spec)
    model = spec.compile()
    for defect in defects:
        defect.tune(model)
    return Twin(model, tuple(p for d in defects for p in d.parameters()), tuple(links))


def _strip(spec: mujoco.MjSpec, visual: bool) -> None:
    """Leave out what the nominal scene has for a viewer only; shapes that touch nothing cost a third of the speed."""
    for element in (*spec.actuators, *spec.keys):
        spec.delete(element)
    spec.compiler.discardvisual = not visual


def _solver(spec: mujoco.MjSpec, timestep: float) -> None:
    """Settings under which wheels neither creep nor chatter at 1 ms; tolerances leave 0.1 N and 1 um of the wheels."""
    option = spec.option
    option.timestep = timestep
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.solver, option.tolerance = mujoco.mjtSolver.mjSOL_PGS, 1e-10
    option.impratio, option.noslip_iterations, option.noslip_tolerance = 10.0, 10, 1e-8
    option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ISLAND | mujoco.mjtDisableBit.mjDSBL_MIDPHASE)


def _brake(spec: mujoco.MjSpec) -> None:
    """Weld the joints that stand still during a campaign and that no defect has replaced."""
    for joint in spec.joints:
        if joint.name.endswith("_joint") and joint.name.startswith(_HELD):
            spec.delete(joint)


def _push(spec: mujoco.MjSpec) -> None:
    """Three forces on the hand, where there is one, in its own axes [N], that a motion may use."""
    if spec.body(HAND) is None:
        return
    site = body(spec, HAND).add_site(name=wrist_sensor.PUSHED)
    for k, name in enumerate(PUSH):
        force = spec.add_actuator(name=name, trntype=mujoco.mjtTrn.mjTRN_SITE, target=site.name)
        force.gear = np.eye(6)[k]


def _fuse(spec: mujoco.MjSpec) -> None:
    """Let the compiler make one body of those welded together; it spares what is named elsewhere, so in an exclusion.

    Wheels stay, since a contact goes by the inertia of its own body, and what hangs on the wrist's sensor.
    """
    spec.compiler.fusestatic = True
    touching = [geom.parent for geom in spec.geoms if geom.contype or geom.conaffinity]
    hung = [site.parent for site in spec.sites if site.name == wrist_sensor.WRIST]
    for kept in (*touching, *hung):
        if kept.parent is not None and not kept.joints:
            spec.add_exclude(bodyname1=kept.name, bodyname2=kept.parent.name)


def _sense(spec: mujoco.MjSpec, links: Sequence[str]) -> None:
    for link in links:
        for kind in _POSES:
            spec.add_sensor(name=f"{link}.{kind.name}", type=kind, objtype=mujoco.mjtObj.mjOBJ_XBODY, objname=link)
    add_plates(spec)
    wrist_sensor.add_wrist(spec)
