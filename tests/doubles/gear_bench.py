"""A test bench for drive trains: links on parallel vertical axes, built as the twin is built, without gravity."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from twin.defects import Defect, Gear
from twin.defects.gear import rotor_joint
from twin.simulation import build

LINK_INERTIA = 0.05  # [kg.m2]
OUTPUT_INERTIA = 0.004  # [kg.m2] of the output gear
_BASE = """<mujoco><option gravity="0 0 0"/><worldbody><body name="base_footprint"><inertial pos="0 0 0" mass="1"
diaginertia="1 1 1"/><site name="plate"/>{links}</body><body name="gripper_grasping_frame"/></worldbody></mujoco>"""
_LINK = """<body name="{0}_link"><joint name="{0}" axis="0 0 1"/><inertial pos="0 0 0" mass="1"
diaginertia="{1} {1} {1}"/></body>"""


def gear(name: str = "elbow", **changes: float) -> Gear:
    """A wrist's gear without friction, whose motor is held as good as still."""
    values = {"gap": 0.02, "stiffness": 1000.0, "damping": 1.0, "coulomb": 0.0, "viscous": 0.0, "rotor_inertia": 50.0}
    values |= {"link_inertia": OUTPUT_INERTIA, "servo_stiffness": 1e6, "servo_damping": 1e4}
    return Gear(name, **(values | changes))


@dataclass(frozen=True)
class Log:
    """Angles and speeds (n, n_links) at each step, and what was applied [rad, rad/s, N.m]."""

    t: np.ndarray
    link: np.ndarray
    motor: np.ndarray
    link_speed: np.ndarray
    motor_speed: np.ndarray
    torque: np.ndarray
    plastic: np.ndarray

    @property
    def twist(self) -> np.ndarray:
        """Link minus motor (n, n_links) [rad]."""
        return self.link - self.motor


@dataclass(frozen=True)
class Bench:
    """Drive trains on a bench.

    Attributes:
        model: The compiled bench.
        names: Its joints.
    """

    model: mujoco.MjModel
    names: tuple[str, ...]

    def run(self, torque=None, command=None, hold=None, speed: float = 0.0, duration: float = 1.0) -> Log:
        """Step through (n, n_links) torques on the links, motor commands, or link angles a stiff controller holds."""
        model, data = self.model, mujoco.MjData(self.model)
        torque, command, hold = (
            None if a is None else np.asarray(a).reshape(-1, len(self.names)) for a in (torque, command, hold)
        )
        n = max([len(a) for a in (torque, command, hold) if a is not None] or [round(duration / model.opt.timestep)])
        links = [model.joint(name).dofadr[0] for name in self.names]
        motors = [model.joint(rotor_joint(name)).dofadr[0] for name in self.names]
        servos = [model.actuator(rotor_joint(name)).id for name in self.names]
        data.qvel[links] = speed
        rows = []
        inertia = LINK_INERTIA + OUTPUT_INERTIA
        for k in range(n):
            if torque is not None:
                data.qfrc_applied[links] = torque[k]
            if command is not None:
                data.ctrl[servos] = command[k]
            if hold is not None:
                push = 2e4 * (hold[k] - data.qpos[links]) - 2.0 * np.sqrt(2e4 * inertia) * data.qvel[links]
                data.qfrc_applied[links] = push
            state = data.qpos[links], data.qpos[motors], data.qvel[links], data.qvel[motors]
            rows.append([np.array(a) for a in state])
            plastic = data.plastic.copy()
            applied = data.qfrc_applied[links].copy()
            mujoco.mj_step(model, data)
            rows[-1] += [applied - inertia * data.qacc[links], plastic]
        link, motor, link_speed, motor_speed, net, state = (np.array(a) for a in zip(*rows, strict=True))
        return Log(np.arange(n) * model.opt.timestep, link, motor, link_speed, motor_speed, net, state)


def bench(defects: Sequence[Defect], names: Sequence[str] = ("elbow",), timestep: float = 0.001) -> Bench:
    """Put drive trains on the bench."""
    links = "".join(_LINK.format(name, LINK_INERTIA) for name in names)
    spec = mujoco.MjSpec.from_string(_BASE.format(links=links))
    return Bench(build(spec, defects, timestep=timestep).model, tuple(names))
