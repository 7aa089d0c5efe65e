"""Names, units, nominal values and tolerances of what is estimated, in one fixed order.

    frame.<a>.<b>         translation [m] and rotation vector [rad] of T_a_b
    geometry.<joint>      exp6 twist on the right of the joint placement [m, rad]
    encoder.<joint>.motor.offset      reading = angle + offset [rad, m]
    gear.<joint>.compliance           reading = angle + offset + compliance * gravity torque [rad/(N.m), m/N]
    backlash.<joint>.gap              reading = angle + ... + gap / 2 * tanh(gravity torque / tau_0) [rad, m]

A joint's offset and the twist along its axis move the hand alike: the data speak of their combination, their
tolerances divide it.
"""

import numpy as np

from calibration.inference.parameters import ParameterSet
from calibration.recording.schema import Description
from calibration.robot.chain import Chain
from calibration.robot.nominal_frames import AXES, METRES_PER_RAD, frame_names, nominal_frames

TRANSLATIONS, ROTATIONS, ZEROS, COMPLIANCES, BACKLASH = range(5)  # groups of parameters whose tolerances share a factor
DEFLECTION = 3e-2  # of a gear at its own largest gravity torque, preloaded backlash included [rad]
_TORQUE = 0.5  # [N.m, N] a joint that gravity loads less has no own range of torque


def parameter_names(chain: Chain) -> tuple[str, ...]:
    """Names of frames, placements, zeros and compliances of a chain, in the order of `HandModel.theta`."""
    return (
        *(f"{prefix}.{axis}" for prefix in frame_names() for axis in AXES),
        *(f"geometry.{joint}.{axis}" for joint in chain.joints for axis in AXES),
        *(f"encoder.{joint}.motor.offset" for joint in chain.joints),
        *(f"gear.{joint}.compliance" for joint in chain.joints),
        *(f"backlash.{joint}.gap" for joint in chain.joints),
    )


def registration_parameters(chain: Chain, description: Description) -> ParameterSet:
    """The two frames alone, without a prior."""
    frames = nominal_frames(chain, description)
    return ParameterSet(
        parameter_names(chain)[:12],
        ("m", "m", "m", "rad", "rad", "rad") * 2,
        frames,
        np.full(12, np.inf),
    )


def geometry_parameters(chain: Chain, description: Description) -> ParameterSet:
    """The two frames, the placement of every joint of the chain and the zero of its encoder."""
    frames, tol = registration_parameters(chain, description), description.tolerances
    k = len(chain.joints)
    lengths = np.array([METRES_PER_RAD if chain.is_prismatic(j) else 1.0 for j in chain.joints])
    return ParameterSet(
        parameter_names(chain)[: 12 + 7 * k],
        frames.units
        + ("m", "m", "m", "rad", "rad", "rad") * k
        + tuple("m" if chain.is_prismatic(j) else "rad" for j in chain.joints),
        np.concatenate([frames.nominal, np.zeros(7 * k)]),
        np.concatenate(
            [
                ([tol.body_translation] * 3 + [tol.body_rotation] * 3) * 2,
                ([tol.joint_translation] * 3 + [tol.joint_rotation] * 3) * k,
                tol.encoder_offset * lengths,
            ]
        ),
        np.concatenate([np.full(12, -1), placement_groups(k), np.full(k, ZEROS)]),
    )


def gear_parameters(chain: Chain, description: Description, tau: np.ndarray) -> ParameterSet:
    """Those of the geometry and the compliance of every gear, seen at gravity torques tau (n, k) [N.m, N]."""
    geometry, k = geometry_parameters(chain, description), len(chain.joints)
    slides = [chain.is_prismatic(j) for j in chain.joints]
    return ParameterSet(
        parameter_names(chain)[: 12 + 8 * k],
        geometry.units + tuple("m/N" if s else "rad/(N.m)" for s in slides),
        np.append(geometry.nominal, np.zeros(k)),
        np.append(geometry.tolerance, gear_tolerances(chain, tau, DEFLECTION)),
        np.append(geometry.groups, np.full(k, COMPLIANCES)),
    )


def backlash_parameters(chain: Chain, description: Description, tau: np.ndarray) -> ParameterSet:
    """Those of the gears and each joint's backlash, half of it as wide as the datasheet's play."""
    gears, k = gear_parameters(chain, description, tau), len(chain.joints)
    return ParameterSet(
        parameter_names(chain),
        gears.units + tuple("m" if chain.is_prismatic(j) else "rad" for j in chain.joints),
        np.append(gears.nominal, np.zeros(k)),
        np.append(gears.tolerance, 2.0 * play_start(chain, description)),
        np.append(gears.groups, np.full(k, BACKLASH)),
    )


def gear_tolerances(chain: Chain, tau: np.ndarray, deflection: float) -> np.ndarray:
    """(k,) compliance that turns each joint by `deflection` [rad] at the largest of its torques tau (n, k)."""
    lengths = np.array([METRES_PER_RAD if chain.is_prismatic(j) else 1.0 for j in chain.joints])
    return deflection * lengths / np.maximum(np.abs(tau).max(axis=0), _TORQUE)


def placement_groups(k: int) -> np.ndarray:
    """Groups of the placement twists of k joints, (6 k,)."""
    return np.tile(np.repeat([TRANSLATIONS, ROTATIONS], 3), k)


def play_start(chain: Chain, description: Description) -> np.ndarray:
    """Datasheet play of each joint of the chain, (k,) [rad, m]."""
    lengths = [METRES_PER_RAD if chain.is_prismatic(j) else 1.0 for j in chain.joints]
    return description.tolerances.joint_play * np.array(lengths)


def play_floor(chain: Chain, description: Description) -> np.ndarray:
    """Smallest random reading error of each joint, (k,) [rad, m]: its encoder's noise, 1/500 of the datasheet play."""
    return np.maximum(description.sigmas.encoder, 2e-3 * play_start(chain, description))
