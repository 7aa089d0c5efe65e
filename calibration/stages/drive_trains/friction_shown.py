"""Friction that holds a link in its gap, as the wrist's sensor shows it under a load that the calibration did not have.

    p_s = w + f(q - delta_s) - mean       delta_s of s f_c, s f_v, c / s
    minimise  1 / c sum (nu + 1) / 2 log(1 + p_s^2 / (nu sigma^2)) + ((s - 1) f_c / sigma_f)^2 / 2

w + f is what the sensor reads beyond the hand's weight and motion, see `robot.wrist_sensor`. A link that its load never
turns shows c f_c, by which friction winds its mesh up, and not f_c. Under a heavier one it falls from flank to flank of
its gap when that exceeds f_c, and the hand's weight turns with it in the sensor's axes: 25 N by 20 mrad are 0.5 N. c
means of a fifth of a second hang together.
"""

from collections.abc import Sequence

import numpy as np

from calibration.numerics.signals import RATE
from calibration.robot.wrist_sensor import STRIDE
from calibration.stages.drive_trains.drive_train import DriveTrain, drive_motion
from calibration.stages.drive_trains.fit.joint_data import window_means
from calibration.stages.drive_trains.hung_load import Hanging
from calibration.stages.drive_trains.kernel.link_motion import COULOMB
from calibration.stages.drive_trains.torques import LinkLoads

_UNKNOWN = 0.1  # of a friction: less uncertain, and it is as calibrated
_SHARES = np.exp(np.linspace(-1.1, 1.1, 45))  # s
_MEAN, _TOGETHER = 0.2, 1.5  # [s] of a mean, and how long its errors hang together
_NU, _SENSOR = 4.0, 0.1  # of Student's distribution; [N] a mean is known to at best
_TURN = 1e-3  # [rad] of the finite difference


def friction_shown(
    trains: Sequence[DriveTrain], joints: Sequence[str], loads: LinkLoads, links: np.ndarray, of: Hanging
) -> np.ndarray:
    """s (k,) of all joints in a trial; 1 where the calibration knows it, or had loads like this one.

    Args:
        trains: Those of the robot.
        joints: Columns of the loads.
        loads: By the motors.
        links: (n, k) link angles with s = 1, zeros of the readings included [rad, m].
        of: The hand on the sensor, on links that are there.
    """
    found, open_ = np.ones(len(joints)), [train for train in trains if _is_open(train, joints, loads)]
    behind = loads.behind(loads.q - links) if open_ else loads
    for train in open_:
        j = joints.index(train.joint)
        found[j] = _share(train, j, behind, of)
    return found


def _uncertain(train: DriveTrain) -> float:
    """Standard deviation of its friction [N.m]; no more than that itself."""
    sigma = next((q.sigma for q in train.parameters if q.name == f"friction.{train.joint}.coulomb"), 0.0)
    return float(np.fmin(sigma, train.values[COULOMB]))


def _is_open(train: DriveTrain, joints: Sequence[str], loads: LinkLoads) -> bool:
    plays = train.dynamic and train.form == "dead_zone" and _uncertain(train) > _UNKNOWN * train.values[COULOMB]
    return plays and train.is_new(loads.torque[:, joints.index(train.joint)])


def _share(train: DriveTrain, j: int, loads: LinkLoads, of: Hanging) -> float:
    """The likeliest s of the joint in column j."""
    read, sensor, phi = of.read.thinned(STRIDE), of.sensor.carrying(of.found), train.inertials
    at, turn = sensor.moved(read), np.zeros(read.q.shape[1])
    turn[j] = _TURN
    pull = (sensor.moved(read._replace(q=read.q - turn)) - at)[:, :3] / _TURN  # by delta [N/rad]
    p = _means((at + read.wrench)[:, :3])
    drive = drive_motion([loads], j, phi if len(phi) else None)
    torque, fallen = drive.torque + train.link_inertia * drive.a, []
    for s in (1.0, *_SHARES):
        rubs = train.rubbing(s)
        fallen.append(np.interp(read.t, drive.t, rubs.deltas(drive, torque, rubs.begun(torque[:1]))))
    left = np.array([p + _means(pull * (delta - fallen[0])[:, None]) for delta in fallen[1:]])
    left -= left.mean(axis=1, keepdims=True)
    size = np.maximum(1.4826 * np.median(np.abs(left), axis=1).min(axis=0), _SENSOR)
    square = np.log1p(left**2 / (_NU * size**2)).sum(axis=(1, 2))
    believed = ((_SHARES - 1.0) * train.values[COULOMB] / _uncertain(train)) ** 2
    return float(_SHARES[np.argmin((_NU + 1.0) * square * _MEAN / _TOGETHER + believed)])


def _means(x: np.ndarray) -> np.ndarray:
    """Of samples (n, ...) over `_MEAN`."""
    return window_means(x, np.arange(0, len(x), round(_MEAN * RATE / STRIDE)))
