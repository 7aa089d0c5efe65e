"""The step `design`: postures for the robot and the laboratory of a scenario, before anything is recorded.

Only what the scenario declares to a laboratory is used: nominal robot, marker bodies, datasheet sigmas, tolerances.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenarios import folder

if TYPE_CHECKING:
    from calibration.design import Criterion
    from calibration.design_postures import Comparison, Plan
    from scenarios.schema import Scenario


@dataclass(frozen=True)
class Designed:
    """A design that was written, and how it compares."""

    plan: "Plan"
    comparison: "Comparison"


def design(scenario: "Scenario", n: int, criterion: "Criterion", out: Path) -> Designed:
    """Choose n postures and write them to the file `out`.

    Raises:
        NotEnoughData: The robot has hardly any posture clear of itself and in sight.
        ScenarioError: `out` cannot be written.
    """
    import mjcf
    from calibration.design_postures import compared, nominal_task, plan
    from calibration.remedy import to_text
    from twin.declare import declaration
    from twin.randomness import generator

    description = declaration(scenario.twin, ())
    rng = generator(scenario.seed, "design")
    found = plan(nominal_task(mjcf.urdf(), description, rng), n, criterion, rng)
    against = compared(found, rng)
    worst, usual = 1e3 * against.designed, 1e3 * float(np.median(against.random))
    why = (
        f"{n} postures by criterion {criterion}: standard deviation of the predicted hand {worst:.2f} mm at worst, "
        f"{usual:.2f} mm with as many random ones"
    )
    with folder.updating(out.parent, [out.name]) as new:
        text = to_text(description.joint_names, [found.remedy("geometry", why)])
        (new / out.name).write_text(text, encoding="utf-8", newline="\n")
    return Designed(found, against)
