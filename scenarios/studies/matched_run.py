"""A run of a matched study: a robot that is what the geometric model says it is, without physics, judged by its truth.

Frames, joint placements and zeros are sampled from the datasheet's tolerances, readings err by its backlash, marker
bodies' means by the markers' noise; Pinocchio says where the hand is. What the fit promises must then hold: where it
does not, the fit is wrong, and not the model.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import stats

from calibration import robot
from calibration.errors import NotCalibrated
from calibration.mocap import Postures, body_poses
from calibration.numerics.lie import adjoint, exp6, inverse
from calibration.recording import Description
from calibration.robot import Chain, HandModel, chain_of, nominal_hand
from calibration.stages.geometry import calibrate_geometry, geometry_parameters, hand_of, reading_sigma, register
from scenarios.datasets.run_spec import Magnitude
from scenarios.files.scenario import Scenario
from scenarios.score.parameters import judge_parameters
from twin.truth import Parameter

_NEW = 30  # postures the fit has not seen
_LEVEL = 0.025  # one-sided


@dataclass(frozen=True)
class MatchedRobot:
    """A robot that is what the geometric model says.

    Attributes:
        chain: Nominal.
        description: Of its laboratory.
        theta: (p,) parameters of the geometry.
        true: The robot.
        new: (m, k) readings that are not among the postures.
        seen: Postures.
    """

    chain: Chain
    description: Description
    theta: np.ndarray
    true: HandModel
    new: np.ndarray
    seen: Postures


Departure = Callable[[Chain, np.ndarray], np.ndarray]


def matched(scenario: Scenario, out: Path) -> tuple[Magnitude, ...]:
    """Write score.json of one robot; as many postures as the scenario's campaign has.

    Raises:
        NotCalibrated: There is no result that may be used.
    """
    found = matched_robot(scenario)
    chain, theta, true, readings = found.chain, found.theta, found.true, found.new
    description, seen, frames = found.description, found.seen, robot.nominal_frames(chain, found.description)
    parameters = geometry_parameters(chain, description)
    model, verdicts = calibrate_geometry(chain, description, seen)
    if refused := [v.message for v in verdicts if v.verdict == "refused"]:
        raise NotCalibrated(refused)
    judged = judge_parameters(model, map(Parameter, parameters.names, parameters.units, theta.tolist()))
    judged.save(out)
    rows = {"registration": register(chain, description, seen)[0], "model_2": model}
    errors = {name: _errors(hand_of(m, chain, frames), true, readings) for name, m in rows.items()}
    gain = stats.ttest_rel(errors["registration"], errors["model_2"], alternative="greater").pvalue
    return (
        Magnitude("coverage_95", judged.coverage_95),
        Magnitude("n_judged", float(judged.n_judged)),
        Magnitude("nees_per_dof", judged.nees / judged.dof),
        *(Magnitude(f"{name}_mm", 1e3 * float(np.sqrt((e**2).mean() / 3.0))) for name, e in errors.items()),
        Magnitude("detected", float(gain < _LEVEL)),
    )


def matched_robot(scenario: Scenario, departure: Departure | None = None) -> MatchedRobot:
    """A robot and its postures; `departure` is what the model does not know: angles (n, k) by chain and readings."""
    import mjcf
    from twin.campaign import describe_dataset
    from twin.motions import sample_postures
    from twin.random_streams import generator

    rng, campaign = generator(scenario.seed, "matched"), scenario.twin.campaign
    description, n = describe_dataset(scenario.twin, ()), campaign.calibration_postures
    chain = chain_of(mjcf.urdf(), description)
    parameters, frames = geometry_parameters(chain, description), robot.nominal_frames(chain, description)
    theta = parameters.nominal + parameters.tolerance * rng.normal(size=len(parameters))
    true = nominal_hand(chain, frames).with_theta(theta, parameters.names)
    readings = rng.permutation(sample_postures(mjcf.model(), n + _NEW, rng))
    moved = readings[:n] + reading_sigma(chain, description) * rng.normal(size=(n, len(chain.joints)))
    poses = true.poses(moved if departure is None else moved + departure(chain, readings[:n]))
    samples = campaign.dwell * scenario.twin.instruments.mocap_rate
    seen = _measured(description, readings[:n], poses, samples, rng)
    return MatchedRobot(chain, description, theta, true, readings[n:], seen)


def _measured(
    description: Description, readings: np.ndarray, T: np.ndarray, samples: float, rng: np.random.Generator
) -> Postures:
    """Means over `samples` of what the markers show of the hand at T (n, 4, 4) in the base body."""
    bodies = (description.base_body, description.hand_body)
    base, hand = (_unit_covariance(np.array([m.xyz for m in body.markers])) for body in bodies)
    Ad = adjoint(inverse(T))
    S = (hand + Ad @ base @ np.swapaxes(Ad, 1, 2)) * description.sigmas.marker**2 / samples
    noise = (np.linalg.cholesky(S) @ rng.normal(size=(len(T), 6, 1)))[..., 0]
    return Postures(readings, T @ exp6(noise), S, np.zeros(len(T)))


def _unit_covariance(xyz: np.ndarray) -> np.ndarray:
    return body_poses(xyz, xyz[None]).covariance[0]


def _errors(hand: HandModel, true: HandModel, q: np.ndarray) -> np.ndarray:
    """Distance of the hand from where it is, (n,) [m]."""
    return np.linalg.norm(hand.poses(q)[:, :3, 3] - true.poses(q)[:, :3, 3], axis=1)
