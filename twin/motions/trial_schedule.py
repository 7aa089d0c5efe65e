"""The trials of a campaign, in the order they are recorded."""

from dataclasses import replace

import mujoco
import numpy as np

from calibration.recording import schema
from twin.motions import driving
from twin.motions import motion as motions
from twin.motions.campaign import JOLTED, Campaign
from twin.motions.csv_trajectory import read_trajectory
from twin.motions.motion import Motion
from twin.motions.postures import sample_postures
from twin.motions.swings import CALIBRATION_SWINGS, FURTHER_SWINGS, JOINTS, VALIDATION_SWINGS, Swing
from twin.random_streams import generator

REGISTRATION = "registration"
_LOADED = ("around_z", "around_y")  # one brings wheels nearest their friction, one turns the hand against gravity
_REGISTRATION_POSTURES = 8


def schedule(campaign: Campaign, nominal: mujoco.MjModel, seed: int) -> tuple[Motion, ...]:
    """Calibration first (statics, spins and drives, sweeps, swings), then validation, then confirmation.

    Of them those the campaign asks for.
    """
    further = {name: path for name, path in FURTHER_SWINGS.items() if name in campaign.only}
    trials = (
        *_calibration_postures(nominal, seed, campaign),
        *driving.trials(campaign),
        *_sweeps(campaign),
        *_swings("calibration", campaign.calibration_swing, CALIBRATION_SWINGS, campaign),
        *_loaded("calibration", _LOADED, campaign.calibration_payloads, campaign.calibration_swing, campaign),
        *_swings("validation", campaign.validation_swing, VALIDATION_SWINGS, campaign),
        *_swings("validation", campaign.validation_swing, further, campaign),
        *_loaded("validation", tuple(VALIDATION_SWINGS)[:1], campaign.payloads, campaign.validation_swing, campaign),
        *((motions.pushed("push", "validation", campaign.push, campaign),) if campaign.push else ()),
        *(read_trajectory(m.file, name, m.role, campaign.rest) for name, m in campaign.motions.items()),
        *_statics("postures_validation", "validation", campaign.validation_postures, nominal, seed, campaign),
        *_jolted(nominal, seed, campaign),
    )
    second = _confirmation(campaign, nominal, seed) if campaign.confirmation else ()
    found = (*(m for m in trials if _asked(campaign, _group(m))), *second)
    return tuple(replace(m, kinematic=True) for m in found) if campaign.carried else found


def _asked(campaign: Campaign, name: str) -> bool:
    return not campaign.only or name in campaign.only or name in campaign.motions


def _group(motion: Motion) -> str:
    return "sweeps" if motion.kind == "sweep" else motion.name


def _confirmation(campaign: Campaign, nominal: mujoco.MjModel, seed: int) -> tuple[Motion, ...]:
    """The second session: a few postures to register the remounted markers, then the validation trials asked for."""
    q = sample_postures(nominal, _REGISTRATION_POSTURES + 1, generator(seed, "postures", REGISTRATION))
    register = motions.static_postures(f"{REGISTRATION}_confirmation", "confirmation", q, campaign)
    swings = _swings("confirmation", campaign.validation_swing, VALIDATION_SWINGS, campaign)
    confirming = (
        *(replace(m, id=f"{m.id}_confirmation") for m in swings),
        *_statics("postures_confirmation", "confirmation", campaign.validation_postures, nominal, seed, campaign),
    )
    return (replace(register, name=REGISTRATION), *confirming) if confirming else ()


def _calibration_postures(nominal: mujoco.MjModel, seed: int, campaign: Campaign) -> tuple[Motion, ...]:
    """The given postures, from the first of them on, or sampled ones."""
    if not campaign.given_postures:
        return _statics("postures", "calibration", campaign.calibration_postures, nominal, seed, campaign)
    q = np.array([campaign.given_postures[0], *campaign.given_postures])
    sides = np.array(campaign.given_approaches) if campaign.given_approaches else None
    return (motions.static_postures("postures", "calibration", q, campaign, sides),)


def _statics(
    id: str, role: schema.Role, n: int, nominal: mujoco.MjModel, seed: int, campaign: Campaign
) -> tuple[Motion, ...]:
    """The first posture is where the trial starts, the n that follow are dwelt in; not sampled unless asked for."""
    if not _asked(campaign, id.replace("_confirmation", "_validation")):
        return ()
    q = sample_postures(nominal, n + 1, generator(seed, "postures", role))
    return (motions.static_postures(id, role, q, campaign),)


def _jolted(nominal: mujoco.MjModel, seed: int, campaign: Campaign) -> tuple[Motion, ...]:
    """The postures of validation, each left and reached with a jolt, where the campaign names them."""
    if JOLTED not in campaign.only:
        return ()
    abrupt = replace(campaign, posture_ramp=None)
    return _statics(JOLTED, "validation", campaign.validation_postures, nominal, seed, abrupt)


def _sweeps(campaign: Campaign) -> tuple[Motion, ...]:
    if campaign.sweep == 0.0:
        return ()
    return tuple(
        motions.swing(
            f"sweep_{j}", "calibration", "sweep", motions.sweep_path(j, campaign.sweep), campaign.sweep, campaign
        )
        for j in JOINTS[1:]
    )


def _loaded(
    role: schema.Role, names: tuple[str, ...], masses: tuple[float, ...], duration: float, campaign: Campaign
) -> tuple[Motion, ...]:
    """Swings with each of further payloads [kg] in the hand."""
    paths = {**CALIBRATION_SWINGS, **VALIDATION_SWINGS}

    def loaded(name: str, mass: float) -> Motion:
        id = f"{name}_{mass:g}kg".replace(".", "_")
        return replace(motions.swing(id, role, "swing", paths[name], duration, campaign), name=name, payload=mass)

    return tuple(loaded(name, mass) for name in names for mass in masses)


def _swings(role: schema.Role, duration: float, paths: dict[str, Swing], campaign: Campaign) -> tuple[Motion, ...]:
    if duration == 0.0:
        return ()
    asked = {name: path for name, path in paths.items() if _asked(campaign, name)}
    return tuple(motions.swing(name, role, "swing", path, duration, campaign) for name, path in asked.items())
