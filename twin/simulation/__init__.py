"""From a specification and defects to states."""

from twin.simulation.base_joint import place_base
from twin.simulation.build import Twin, build
from twin.simulation.kinematic import kinematic_states
from twin.simulation.rollout import simulate
from twin.simulation.states import States

__all__ = [
    "States",
    "Twin",
    "build",
    "kinematic_states",
    "place_base",
    "simulate",
]
