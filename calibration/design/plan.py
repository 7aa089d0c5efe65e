"""Postures to record: chosen for their information, with the side each joint comes from, in an order to drive them.

From a robot's room to a design: a coarse choice, then the neighbourhoods of what was chosen.

Candidates are sampled over the whole room, the best are chosen (`design`), and twice more from ever nearer neighbours
of those: the best postures lie at limits that a coarse pool misses.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from calibration.design.candidates import Room, room_of
from calibration.design.collisions import shapes_of
from calibration.design.exchange import Criterion, choose
from calibration.design.information import Departures, Prospect, departing, departures_of, prospect
from calibration.design.sequence import Sides, Tour, sides, tour
from calibration.inference.parameters import ParameterSet
from calibration.recording.experiment import ExperimentPlan, Posture, Sigma
from calibration.recording.schema import Description
from calibration.robot.chain import chain_of
from calibration.robot.hand import HandModel
from calibration.robot.nominal_frames import nominal_frames
from calibration.stages.geometry.parameters import full_parameters, hand_model, reading_floor, reading_sigma

_ANYWHERE = 200  # postures from which largest torques are determined
_RANDOM = 100  # sets of random postures the design is compared with
_FRESH = 300  # postures the comparison predicts the hand at
Sample = Callable[[int, np.random.Generator], np.ndarray]
"""So many postures (n, n_measured), sampled."""
_POOL = 500
_WIDTHS = (0.12, 0.05)  # of a joint's range, of the neighbours of the second and third choice [-]
_NEIGHBOURS = 400
_AT = 120  # postures the hand is predicted at


@dataclass(frozen=True)
class Task:
    """What is to be found, of which robot.

    Attributes:
        room: Where postures may be.
        model: The robot as far as it is known.
        parameters: To be found, with tolerances.
        reading_sigma: (k,) random error of each joint's reading [rad, m].
        known: (p, p) covariance of the scaled parameters by what is recorded already; None: nothing is.
        departures: What the robot does and no parameter describes; None: nothing.
        work: Draws postures like those the robot works in; None: anywhere in its room.
    """

    room: Room
    model: HandModel
    parameters: ParameterSet
    reading_sigma: np.ndarray
    known: np.ndarray | None = None
    departures: Departures | None = None
    work: Sample | None = None

    def prospect(self, q: np.ndarray, at: np.ndarray) -> Prospect:
        """What candidates q identify of the hand at other postures."""
        expected = prospect(self.model, self.parameters, self.room.description, self.reading_sigma, q, at, self.known)
        if self.departures is None:
            return expected
        return departing(expected, self.model, self.room.description, self.reading_sigma, self.departures, at)

    def sample(self, n: int, rng: np.random.Generator) -> np.ndarray:
        """Postures (n, n_measured) like those the robot works in."""
        return (self.work or self.room.pool)(n, rng)


@dataclass(frozen=True)
class Comparison:
    """Worst-case predicted error of the hand over postures nothing was chosen by [m].

    Attributes:
        designed: After the design.
        random: (m,) after as many random postures, sampled like those.
    """

    designed: float
    random: np.ndarray

    @property
    def gain(self) -> float:
        """1 - designed / median of random [-]."""
        return float(1.0 - self.designed / np.median(self.random))


def nominal_task(urdf: str, description: Description, rng: np.random.Generator, work: Sample | None = None) -> Task:
    """All that row `full` asks static postures for, of a robot of which only the datasheet is known.

    Args:
        urdf: Of the robot.
        description: Of the laboratory.
        rng: For what is sampled.
        work: Draws postures like those the robot works in.
    """
    chain = chain_of(urdf, description)
    play = np.maximum(reading_sigma(chain, description), reading_floor(chain, description))
    room = room_of(shapes_of(urdf, chain, description), description, rng)
    anywhere = room.sample(_ANYWHERE, rng)
    parameters = full_parameters(chain, description, chain.gravity_torques(anywhere))
    departures = departures_of(chain, anywhere)
    hand = hand_model(chain, nominal_frames(chain, description))
    return Task(room, hand, parameters, play, departures=departures, work=work)


@dataclass(frozen=True)
class Design:
    """Chosen postures.

    Attributes:
        prospect: Candidates of the last choice.
        chosen: (n,) indices of those to record.
    """

    prospect: Prospect
    chosen: np.ndarray

    @property
    def q(self) -> np.ndarray:
        """(n, n_measured) the postures to record [rad, m]."""
        return np.asarray(self.prospect.q[self.chosen])

    @property
    def C(self) -> np.ndarray:
        """Covariance of the identifiable directions once they are recorded."""
        return self.prospect.after(self.chosen)


@dataclass(frozen=True)
class Plan:
    """A design with what to know about it."""

    task: Task
    design: Design
    sides: Sides
    tour: Tour

    @property
    def postures(self) -> tuple[Posture, ...]:
        """In the order to record them."""
        chain, q = self.task.model.chain, self.design.q
        approach = np.zeros(q.shape, dtype=int)
        approach[:, chain.columns] = self.sides.approach
        rows = zip(q[self.tour.order], approach[self.tour.order], strict=True)
        return tuple(Posture(tuple(map(float, a)), tuple(int(s) for s in b)) for a, b in rows)  # type: ignore[misc]

    def remedy(self, stage: str, why: str, names: tuple[str, ...] | None = None) -> ExperimentPlan:
        """The postures with the standard deviations of these parameters (all, where none is named)."""
        p, prospect_ = self.task.parameters, self.design.prospect
        rows = zip(p.names, p.units, prospect_.sigma(prospect_.C), prospect_.sigma(self.design.C), strict=True)
        expected = tuple(Sigma(n, u, float(a), float(b)) for n, u, a, b in rows if names is None or n in names)
        return ExperimentPlan(stage, why, self.postures, sigma=expected)


def plan(task: Task, n: int, criterion: Criterion, rng: np.random.Generator) -> Plan:
    """Choose n postures.

    Raises:
        NotEnoughData: The robot has hardly any posture clear of itself and in sight.
    """
    found = search(task.room, task.prospect, n, criterion, rng, task.work)
    return Plan(
        task, found, sides(found.prospect, found.chosen, task.reading_sigma, rng), tour(found.q, task.room.shapes)
    )


def compared(found: Plan, rng: np.random.Generator) -> Comparison:
    """The design against random postures like those the robot works in, the hand predicted at others, new to both."""
    task, n = found.task, len(found.design.chosen)
    sampled = task.sample(_FRESH + 4 * n, rng)
    p = task.prospect(np.concatenate([sampled[_FRESH:], found.design.q]), sampled[:_FRESH])
    sets = [rng.choice(4 * n, n, replace=False) for _ in range(_RANDOM)]
    *random, designed = (p.hand(p.after(x), p.pulled(x)).max() for x in (*sets, 4 * n + np.arange(n)))
    return Comparison(float(designed), np.array(random))


def search(
    room: Room,
    prospect_at: Callable[[np.ndarray, np.ndarray], Prospect],
    n: int,
    criterion: Criterion,
    rng: np.random.Generator,
    work: Sample | None = None,
) -> Design:
    """Choose n postures in a room; `prospect_at(q, at)` is what candidates identify of the hand at other postures.

    Those are sampled by `work`, anywhere in the room where it is not given; candidates from both.

    Raises:
        NotEnoughData: The room has hardly any postures.
    """
    size = max(_POOL, 5 * n)
    if work is None:
        pool = room.pool(size + _AT, rng)
        at, pool = pool[:_AT], pool[_AT:]
    else:
        at, pool = work(_AT, rng), np.concatenate([room.pool(size // 2, rng), room.admits(work(size // 2, rng))])
    prospect = prospect_at(pool, at)
    chosen = choose(prospect, n, criterion)
    for width in _WIDTHS:
        near = room.near(pool[chosen], max(1, _NEIGHBOURS // n), width, rng)
        pool = np.concatenate([pool[chosen], near])
        prospect = prospect_at(pool, at)
        chosen = choose(prospect, n, criterion, np.arange(n))
    return Design(prospect, chosen)
