"""The five postures (more, where more are lacking) that identify most of what the recorded ones leave to tolerances.

    C before = T^-1 Sigma T^-1,     Sigma the covariance of the fit, T = diag(tolerance)        (see `information`)
    C after  = (C^-1 + sum_5 B' B)^-1

A direction is unobserved where the data shrink its prior variance by less than a tenth, while postures elsewhere
inside the limits would shrink it. Directions no posture shows, the gauge, do not move the hand and are not counted.
They are chosen by D, which looks for unobserved directions first. After a rejected fit the robot is taken as nominal,
and its random errors as the recorded postures suggest (`believed_play`).

How large the readings' random errors are believed to be where a fit must not be relied on.

    s = lambda s_datasheet of all joints,        ln lambda uniform between ln _LEAST and 0
    believed s^2 = s_datasheet^2 sum_l lambda_l^2 p(data | lambda_l) / sum_l p(data | lambda_l)

A datasheet states what backlash is tolerated, not what there is. p(data | lambda) is the evidence, parameters
integrated out at their tolerances (`evidence`): few postures identify little and leave a third of the datasheet's
backlash (the root mean square of a log-uniform factor), more of them identify it, and data that fit no robot need all
of it.
"""

from dataclasses import dataclass, replace

import numpy as np

from calibration.design.candidates import room_of
from calibration.design.collisions import shapes_of
from calibration.design.information import dwell_noise, identified_directions, prospect
from calibration.design.plan import Plan, Task, plan
from calibration.errors import NotEnoughData
from calibration.inference.marginal_likelihood import Hyperparameters, log_marginal
from calibration.inference.parameters import Model, ParameterSet
from calibration.mocap.postures import Postures
from calibration.recording.experiment import ExperimentPlan, Sigma
from calibration.recording.schema import Description
from calibration.robot.chain import Chain
from calibration.robot.hand import HandModel
from calibration.robot.nominal_frames import nominal_frames
from calibration.robot.parameter_block import joint_lengths
from calibration.stages.geometry.guards import APART, distinct, recommended
from calibration.stages.geometry.hand_residual import NoiseModel, hand_problem
from calibration.stages.geometry.model_of_fit import hand_of
from calibration.stages.geometry.parameters import geometry_parameters, hand_model, reading_floor, reading_sigma
from calibration.verdict import Verdict

STAGE, FILE = "geometry", "record_next.yaml"
N = 5
_UNOBSERVED = 0.9  # of a direction's prior variance, left of it [-]
_FALLS = 0.7  # sigma after over before, of parameters worth naming [-]
_NEVER = 0.99  # sigma after over before, of parameters that no posture shows [-]
_NAMED = 12
_PROBES = 120  # postures anywhere inside the limits, for what could be identified at all
_SEED = 0  # the same data get the same suggestion
_LEAST = 1e-2
_POINTS = 21


@dataclass(frozen=True)
class Known:
    """What recorded postures identify of a geometry.

    Attributes:
        hand: The robot as far as it is known.
        parameters: To be found, with tolerances.
        reading_sigma: (k,) random error of each joint's reading [rad, m].
        description: With the marker noise the recorded postures had.
        C: (p, p) covariance of the scaled parameters.
        unobserved: Number of directions that postures could identify and these did not.
    """

    hand: HandModel
    parameters: ParameterSet
    reading_sigma: np.ndarray
    description: Description
    C: np.ndarray
    unobserved: int


def record_next(
    urdf: str, chain: Chain, description: Description, postures: Postures, model: Model, refused: bool
) -> tuple[ExperimentPlan | None, tuple[Verdict, ...]]:
    """Postures to record after the geometry `model` from `postures`; None where they would identify nothing new."""
    rng = np.random.default_rng(_SEED)
    known = _known(chain, description, postures, model, refused, rng)
    lost = tuple(
        p.name for p in model.parameters if p.status == "not_identifiable" and p.name in known.parameters.names
    )
    short = _short(chain, postures)
    if not known.unobserved and not lost and short <= 0:
        return None, ()
    try:
        room = room_of(shapes_of(urdf, chain, description), known.description, rng)
        task = Task(room, known.hand, known.parameters, known.reading_sigma, known.C)
        found = plan(task, max(N, short), "D", rng)
    except NotEnoughData as error:
        return None, (Verdict(STAGE, "warning", f"no postures to suggest: {error}"),)
    remedy = _remedy(found, known, lost, short)
    sigma = ", ".join(f"{s.name} {s.before:.2g} -> {s.after:.2g} {s.unit}" for s in remedy.sigma[:3])
    return remedy, (
        Verdict(
            STAGE,
            "warning",
            f"{remedy.why}; {len(remedy.postures)} postures that would, in {FILE}: {sigma}",
        ),
    )


def _known(
    chain: Chain, description: Description, postures: Postures, model: Model, refused: bool, rng: np.random.Generator
) -> Known:
    """From a fit, or from the datasheet where it must not be relied on."""
    parameters = geometry_parameters(chain, description)
    frames, p = nominal_frames(chain, description), len(parameters)
    hand = hand_model(chain, frames)
    names = [x.name for x in model.parameters]
    rows = [names.index(name) for name in parameters.names]
    play = np.maximum(reading_sigma(chain, description), reading_floor(chain, description))
    if refused:
        theta = np.array([model.parameters[row].value for row in rows])
        play = believed_play(hand, parameters, postures, theta, play)
    else:
        hand = hand_of(model, chain, frames)
        play = model.reading_sigma if len(model.reading_sigma) else play
    description = _as_measured(description, postures)
    low, high = (np.clip(x, -np.pi, np.pi) for x in chain.limits)
    anywhere = rng.uniform(low, high, size=(_PROBES, len(low)))
    V = identified_directions(prospect(hand, parameters, description, play, anywhere, anywhere[:1], np.eye(p)).B)
    prospects = prospect(hand, parameters, description, play, postures.q, anywhere[:1], np.eye(p))
    C = by_tolerance = prospects.after(np.arange(len(postures)))
    if not refused:
        C = model.covariance[np.ix_(rows, rows)] / np.outer(parameters.scale, parameters.scale)
    unobserved = int((np.linalg.eigvalsh(V.T @ by_tolerance @ V) > _UNOBSERVED).sum())
    return Known(hand, parameters, play, description, C, unobserved)


def _short(chain: Chain, postures: Postures) -> int:
    """How many distinct postures a geometry still lacks."""
    enough = recommended(chain, postures.covariance.shape[1])
    return enough - distinct(postures.q[:, chain.columns], APART * joint_lengths(chain))


def _as_measured(description: Description, postures: Postures) -> Description:
    """With the marker noise that makes dwells as uncertain as the recorded ones are."""
    expected = dwell_noise(postures.T_base_hand, description)
    if expected.shape != postures.covariance.shape:
        return description
    ratio = np.trace(np.linalg.solve(expected, postures.covariance), axis1=1, axis2=2) / expected.shape[1]
    sigma = description.sigmas.marker * float(np.sqrt(np.median(ratio)))
    return description.model_copy(update={"sigmas": description.sigmas.model_copy(update={"marker": sigma})})


def _remedy(found: Plan, known: Known, lost: tuple[str, ...], short: int) -> ExperimentPlan:
    """The postures with what they do to the hand, to what was lost, and to what they identify best."""
    hand = [float(found.design.prospect.hand(C).max()) for C in (found.design.prospect.C, found.design.C)]
    whole = found.remedy(STAGE, "").sigma
    most = sorted((s for s in whole if s.after < _FALLS * s.before), key=lambda s: s.after / s.before)[:_NAMED]
    named = {s.name for s in most} | set(lost)
    why = f"{known.unobserved} of {_directions(found)} identifiable combinations are determined by the prior only"
    if short > 0:
        why = f"{short} distinct postures are missing; {why}"
    never = [s.name for s in whole if s.name in lost and s.after > _NEVER * s.before]
    if set(lost) - set(never):
        why += f"; not identifiable: {', '.join(name for name in lost if name not in never)}"
    if never:
        why += f"; no posture identifies {', '.join(never)}"
    prospects = (Sigma("hand.position", "m", *hand), *(s for s in whole if s.name in named and s.name not in never))
    return replace(found.remedy(STAGE, why), sigma=prospects)


def _directions(found: Plan) -> int:
    return int(identified_directions(found.design.prospect.B).shape[1])


def believed_play(
    hand: HandModel, parameters: ParameterSet, postures: Postures, theta: np.ndarray, play: np.ndarray
) -> np.ndarray:
    """(k,) [rad, m] from postures, a robot near theta (p,) and the datasheet's `play` (k,)."""
    problem = hand_problem(hand, parameters, postures, NoiseModel(play, _LEAST * play, np.zeros(0)))
    at, f = problem.linearise(theta), problem.widths.prior
    noise, factors = problem.noise, np.geomspace(_LEAST, 1.0, _POINTS)
    values = [
        log_marginal(at, noise, problem.prior, Hyperparameters(np.append(x * play, 1.0), f)).value for x in factors
    ]
    likely = np.exp(np.min(values) - np.array(values))
    return np.asarray(play * np.sqrt(likely @ factors**2 / likely.sum()))
