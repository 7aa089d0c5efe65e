"""Drive trains that are what their model says, in the motions of a campaign: intervals contain the share they state."""

from collections import Counter

import numpy as np
import pytest
from scipy.signal import lfilter

import calibration
from calibration.prediction.predict import predictor
from calibration.stages.drive_trains.drive_train import DriveTrain, drive_motion, harmonic_terms
from calibration.stages.drive_trains.fit.identification import identify
from calibration.stages.drive_trains.fit.joint_data import COARSE, CORRELATED, WINDOW, joint_data
from calibration.stages.drive_trains.fit.quantities import MOTOR
from calibration.stages.drive_trains.stage import DEFLECTION, is_long, loads_of_trial
from calibration.stages.drive_trains.torques import inertial_tolerances, load_modes
from scenarios import load

pytestmark = pytest.mark.slow
ROBOTS, FIRST = 300, 2000  # of seven joints: 2,100
SPREAD = (0.5, 1.5)  # of the default robot's gap, stiffness and friction
ERROR = 1e-4  # [rad] of a difference of readings; errors hang together as long as the fit says
ECCENTRICITY = np.array([2.5e-3, 2.5e-3, 0.6e-3, 0.6e-3])  # [rad]
STEP = 1e-3  # [s] of the link's motion


class Campaign:
    """Loads of a recorded campaign's calibration trials, and the joints that have them."""

    def __init__(self, run):
        dataset, estimate = calibration.load(run.folder / "dataset"), run.estimate
        robot = predictor(estimate, dataset).bundled
        trials = [trial for _, trial in dataset.trials("calibration") if is_long(trial)]
        self.loads = [loads_of_trial(robot.trains, t, estimate.clock("robot"), robot.hand) for t in trials]
        self.tolerance, self.dynamics = dataset.description.tolerances, robot.trains.dynamics
        C = inertial_tolerances(self.dynamics, self.tolerance.link_mass, self.tolerance.link_com)
        self.root = np.linalg.cholesky(C + 1e-12 * np.eye(len(C)))
        self.joints = [joint for joint in self.dynamics.joints if joint.startswith("arm_")]
        self.nominal = load("humanoids2024").twin.arm


def sampled(campaign, joint, rng):
    """A drive train, its load's inertial parameters, and its gear and encoder as true values by name."""
    nominal = campaign.nominal[joint]
    gap, stiffness, coulomb, viscous = (
        getattr(nominal, name) * rng.uniform(*SPREAD) for name in ("gap", "stiffness", "coulomb", "viscous")
    )
    eccentricity = ECCENTRICITY * rng.normal(size=4)
    values = np.array([0.5 * gap, 1.0 / stiffness, coulomb, viscous, 1.5e-3, 0.0, 0.0])
    true = {
        f"backlash.{joint}.gap": gap,
        f"gear.{joint}.compliance": 1.0 / stiffness,
        f"friction.{joint}.coulomb": coulomb,
        f"friction.{joint}.viscous": viscous,
    }
    names = (f"encoder.{joint}.link.{what}" for what in ("cos1", "sin1", "cos2", "sin2"))
    true |= dict(zip(names, eccentricity, strict=True))
    return (
        DriveTrain(joint, "dead_zone", values),
        campaign.root @ rng.normal(size=len(campaign.root)),
        eccentricity,
        true,
    )


def correlated(rng, sizes, t):
    """Errors of one standard deviation, exp(-2 t / CORRELATED) alike in each trial: independent as often as counted."""
    decay = np.exp(-2.0 * float(np.median(np.diff(t))) / CORRELATED)
    fresh = np.sqrt(1.0 - decay**2)
    return np.concatenate([lfilter([fresh], [1.0, -decay], rng.normal(size=n)) for n in sizes])


def judged(campaign, joint, rng):
    """Whether each estimated parameter's interval of 95 % contains the true value, by its kind."""
    train, inertials, eccentricity, true = sampled(campaign, joint, rng)
    j = campaign.dynamics.joints.index(joint)
    motion = drive_motion(campaign.loads, j, inertials)
    low, high = train.ends(motion.torque[motion.begins[:-1]])
    delta = train.deltas(motion, motion.torque, low + rng.uniform(size=len(low)) * (high - low), STEP)
    angle = np.concatenate([of.angle[:, j] for of in campaign.loads])
    off = MOTOR * rng.normal(size=4) - eccentricity  # of the motor encoder less the link's
    y = delta + harmonic_terms(angle) @ off + ERROR * correlated(rng, np.diff(motion.begins), motion.t)
    differences = [np.repeat(part[:, None], j + 1, axis=1) for part in np.split(y, motion.begins[1:-1])]
    modes = load_modes(campaign.loads, j, campaign.root)
    data, coarse = (joint_data(campaign.loads, differences, j, modes, window) for window in (WINDOW, COARSE))
    found, _ = identify(joint, data, coarse, modes, campaign.tolerance.joint_play, DEFLECTION, 0.0)
    for q in found.parameters:
        if q.status == "estimated" and q.name in true:
            yield q.name.split(f".{joint}.")[-1], abs(q.value - true[q.name]) < 1.96 * q.sigma


def test_intervals_of_drive_trains_contain_the_share_they_state(quick_run, claim):
    campaign, inside, count = Campaign(quick_run), Counter(), Counter()
    for seed in range(FIRST, FIRST + ROBOTS):
        rng = np.random.default_rng(seed)
        for joint in campaign.joints:
            for what, holds in judged(campaign, joint, rng):
                inside[what] += holds
                count[what] += 1
    share = inside.total() / count.total()
    print({what: (round(inside[what] / n, 3), n) for what, n in count.items()})
    claim(f"matched/drive trains/95 % intervals of {ROBOTS * len(campaign.joints)} joints", share)
    assert 0.93 <= share <= 0.97
