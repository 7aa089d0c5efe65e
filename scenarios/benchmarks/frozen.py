"""What is frozen of bench-v1: its robots, their scenario files and truths, and marks of their recordings.

    truth    sha256 over the robot's true parameters, 9 significant digits each
    marks    of each trial: mean place of the hand's markers [m, lab] and mean of all readings [rad]

Truths are sampled again in a moment; recordings of another machine agree to `TOLERANCE` in their marks, of which
robots beyond the quick tier have those of one swing.
"""

import hashlib
import json
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from calibration.recording import Dataset
from scenarios.datasets.run_spec import seed_of
from scenarios.files.errors import ScenarioError
from scenarios.files.scenario import Scenario
from scenarios.steps import load
from twin.truth import Parameter

NAME = "bench-v1"
TOLERANCE = 1e-4
"""Largest difference of a mark between machines [m, rad]."""
TIERS = {"quick": 4, "full": 20}
"""Robots of a tier, the first ones."""
_HERE = Path(__file__).parent / "bench_v1"
_MANIFEST = _HERE / "manifest.json"


@dataclass(frozen=True)
class Robot:
    """A robot of the benchmark.

    Attributes:
        id: Its number.
        scenario: File its truth is sampled from.
        truth: Hex digest of its true parameters.
        marks: By trial, all of the quick tier's robots, one of the others: x, y, z of the hand [m], mean reading [rad].
    """

    id: int
    scenario: str
    truth: str
    marks: dict[str, tuple[float, ...]]

    @property
    def name(self) -> str:
        """Of its folders and files."""
        return f"robot_{self.id:02d}"

    def series(self) -> Scenario:
        """Its scenario with the root of all robots' seeds."""
        return load(_HERE / f"{self.scenario}.yaml")


def robots(tier: str) -> tuple[Robot, ...]:
    """Robots of a tier as they were frozen.

    Raises:
        ScenarioError: There is no such tier.
    """
    if tier not in TIERS:
        raise ScenarioError(f"--tier {tier}: there are {', '.join(TIERS)}")
    content = json.loads(_MANIFEST.read_text(encoding="utf-8"))
    return tuple(Robot(**entry) for entry in content["robots"])[: TIERS[tier]]


def scenario_digests() -> dict[str, str]:
    """Hex sha256 of the scenario files."""
    return {path.stem: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(_HERE.glob("*.yaml"))}


def frozen_digests() -> dict[str, str]:
    """The same when they were frozen."""
    return dict(json.loads(_MANIFEST.read_text(encoding="utf-8"))["scenarios"])


def truth_digest(robot: Robot) -> str:
    """Hex digest of what a robot's true parameters are."""
    from twin.campaign import laboratory

    series = robot.series()
    return digest(laboratory(series.twin, seed_of(series.seed, robot.id)).twin.truth)


def digest(parameters: Iterable[Parameter]) -> str:
    """Hex sha256 of parameters by name, 9 significant digits."""
    lines = sorted(f"{p.name} {p.value + 0.0:.9g}\n" for p in parameters)
    return hashlib.sha256("".join(lines).encode()).hexdigest()


def marks(dataset: Dataset) -> dict[str, tuple[float, ...]]:
    """Marks of the trials of a dataset."""
    found = {}
    for entry in dataset.description.trials:
        trial = dataset.read(entry)
        hand = trial.marker_position[:, trial.markers_of(dataset.description.hand_body.name)]
        values = (*np.nanmean(hand, axis=(0, 1)), np.mean(trial.q_motor))
        found[entry.id] = tuple(round(float(x), 7) for x in values)
    return found


def differences(robot: Robot, dataset: Dataset) -> Iterator[str]:
    """How recordings made here differ from the frozen ones beyond the tolerance."""
    found = marks(dataset)
    if missing := sorted(robot.marks.keys() - found.keys()):
        yield f"{robot.name}: no trials {', '.join(missing)}; there are {sorted(found)}"
        return
    for trial, values in robot.marks.items():
        far = float(np.abs(np.subtract(found[trial], values)).max())
        if not far <= TOLERANCE:
            yield f"{robot.name}, {trial}: marks differ by {far:.2g} m or rad, at most {TOLERANCE:g} allowed"


def manifest(found: Iterable[Robot]) -> str:
    """Text of the manifest that freezes these robots."""
    lines = ",\n  ".join(json.dumps(asdict(robot)) for robot in found)
    return f'{{"name": "{NAME}",\n "scenarios": {json.dumps(scenario_digests())},\n "robots": [\n  {lines}]}}\n'
