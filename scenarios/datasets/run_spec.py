"""What one run of a collection is: a pure function of the scenario and the run's number.

    seed_i = first 64 bits of SeedSequence(root, spawn_key=(i,))

so that a run depends neither on the other runs, nor on who computes it, nor on when.
"""

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scenarios.files.scenario import Scenario


class Magnitude(NamedTuple):
    """A figure of one run: a name that ends in its unit, and its value."""

    name: str
    value: float


Produce = Callable[[Scenario, Path], tuple[Magnitude, ...]]
"""Writes what a run consists of into an empty folder and returns its figures; a module-level function."""


@dataclass(frozen=True)
class Order:
    """One run to make.

    Attributes:
        id: Its number.
        folder: Of the collection.
        scenario: As resolved, JSON text; its seed is the collection's root.
        produce: What makes it.
        digest: Of all that decides the bytes of the collection.
    """

    id: int
    folder: Path
    scenario: str
    produce: Produce
    digest: str

    @property
    def place(self) -> Path:
        """Folder of the run."""
        return self.folder / "runs" / run_name(self.id)

    def resolved(self) -> Scenario:
        """The scenario with the run's own seed."""
        scenario = Scenario.model_validate_json(self.scenario)
        return scenario.model_copy(update={"seed": seed_of(scenario.seed, self.id)})


def run_name(id: int) -> str:
    """Name of a run's folder."""
    return f"{id:06d}"


def seed_of(root: int, id: int) -> int:
    """Seed of run `id` under a root seed."""
    return int(np.random.SeedSequence(root, spawn_key=(id,)).generate_state(1, np.uint64)[0])


def digest_of(scenario: Scenario, produce: Produce, versions: tuple[tuple[str, str], ...]) -> str:
    """Hex digest of what decides the bytes of a collection, its size apart."""
    content = [scenario.model_dump(mode="json"), f"{produce.__module__}.{produce.__qualname__}", versions]
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
