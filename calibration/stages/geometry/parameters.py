"""Which parameter blocks each geometric fit has, with priors from the datasheet; see `robot.blocks`.

A new block is a file, and its name in `FULL`.
"""

from collections.abc import Sequence

import numpy as np

from calibration.inference.parameters import ParameterSet
from calibration.recording.schema import Description
from calibration.robot.blocks import AT_REST, GEOMETRY, BacklashPreload, Frames
from calibration.robot.chain import Chain
from calibration.robot.hand import HandModel, nominal_hand
from calibration.robot.nominal_frames import nominal_frames
from calibration.robot.parameter_block import Known, ParameterBlock, joint_lengths, parameters_of

FULL: tuple[type[ParameterBlock], ...] = AT_REST  # of row `full`


def hand_model(chain: Chain, frames: np.ndarray) -> HandModel:
    """The nominal robot with marker frames (12,) [m, rad] and every block of row `full`."""
    return nominal_hand(chain, frames, FULL)


def registration_parameters(chain: Chain, description: Description) -> ParameterSet:
    """The two frames alone, without a prior."""
    block = Frames.nominal(chain, nominal_frames(chain, description))
    return ParameterSet(block.names, block.units, block.values, np.full(len(block.names), np.inf))


def geometry_parameters(chain: Chain, description: Description) -> ParameterSet:
    """The two frames, the placement of every joint of the chain and the zero of its encoder."""
    return _parameters(GEOMETRY, chain, description, np.zeros((0, len(chain.joints))))


def compliance_parameters(chain: Chain, description: Description, tau: np.ndarray) -> ParameterSet:
    """Those of row `full` but backlash, seen at gravity torques tau (n, k) [N.m, N]."""
    kinds = [kind for kind in FULL if kind is not BacklashPreload]
    return _parameters(kinds, chain, description, tau)


def full_parameters(chain: Chain, description: Description, tau: np.ndarray) -> ParameterSet:
    """Those of row `full`, seen at gravity torques tau (n, k) [N.m, N]."""
    return _parameters(FULL, chain, description, tau)


def averaged_names(hand: HandModel) -> tuple[str, ...]:
    """Names of the parameters of which a fit averages over which are zero."""
    return tuple(name for block in hand.blocks if block.averaged for name in block.names)


def reading_names(chain: Chain) -> tuple[str, ...]:
    """Names of the random errors of the joints' readings."""
    return tuple(f"reading.{joint}" for joint in chain.joints)


def reading_sigma(chain: Chain, description: Description) -> np.ndarray:
    """Datasheet backlash of each joint of the chain, (k,) [rad, m]."""
    return description.tolerances.joint_play * joint_lengths(chain)


def reading_floor(chain: Chain, description: Description) -> np.ndarray:
    """Smallest random reading error of each joint, (k,) [rad, m]: its encoder's noise, 1/500 of the datasheet's."""
    return np.maximum(description.sigmas.encoder, 2e-3 * reading_sigma(chain, description))


def _parameters(
    kinds: Sequence[type[ParameterBlock]], chain: Chain, description: Description, tau: np.ndarray
) -> ParameterSet:
    frames, tolerances = Frames.nominal(chain, nominal_frames(chain, description)), description.tolerances
    bodies, names = (description.base_body, description.hand_body), np.reshape(frames.names, (2, 6))
    known = Known(
        chain,
        tolerances,
        np.concatenate([tolerances.body(body) for body in bodies]),
        tau,
        measured=tuple(name for body, of in zip(bodies, names, strict=True) if body.tolerance for name in of),
    )
    return parameters_of([kind.nominal(chain, frames.values) for kind in kinds], known)
