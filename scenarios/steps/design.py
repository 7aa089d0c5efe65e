"""The step `design`: postures for the robot and the laboratory of a scenario, before anything is recorded.

Only what the scenario declares to a laboratory is used: nominal robot, marker bodies, datasheet sigmas, tolerances.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError

from scenarios.files import output_folder
from scenarios.files.errors import ScenarioError
from scenarios.steps.run_steps import Progress, silent

if TYPE_CHECKING:
    from calibration.design import BasePlan, Comparison, Criterion, Plan, Sample
    from scenarios.files.scenario import Scenario


_CHOOSING = 0.85  # share of the time of a design that the choice of postures takes
BASE_MOTIONS = 5
PLAYED = ("tour.csv", "tour_rests.csv", "tour_play_motion.yaml", "tour_trajectory.yaml")


@dataclass(frozen=True)
class Designed:
    """A design that was written, and how it compares."""

    plan: "Plan"
    comparison: "Comparison"


def design(  # noqa: PLR0913  a file each
    scenario: "Scenario",
    n: int,
    criterion: "Criterion",
    out: Path,
    campaign: Path | None = None,
    play: Path | None = None,
    progress: Progress = silent,
) -> Designed:
    """Choose n postures and write them to the file `out`.

    Into the file `campaign` goes the scenario that records them, into the folder `play` what a robot plays.

    Raises:
        NotEnoughData: The robot has hardly any posture clear of itself and in sight.
        ScenarioError: `out` cannot be written.
    """
    import calibration.design
    import mjcf
    from calibration.design import compared, nominal_task, played
    from calibration.recording import plans_text
    from scenarios.files import yaml_file
    from twin.campaign import describe_dataset
    from twin.random_streams import generator

    description = describe_dataset(scenario.twin, ())
    rng = generator(scenario.seed, "design")
    progress("design", "postures", 0.0)
    found = calibration.design.plan(nominal_task(mjcf.urdf(), description, rng, _work()), n, criterion, rng)
    progress("design", "random sets beside them", _CHOOSING)
    against = compared(found, rng)
    worst, usual = 1e3 * against.designed, 1e3 * float(np.median(against.random))
    why = (
        f"{n} postures by criterion {criterion}: standard deviation of the predicted hand {worst:.2f} mm at worst, "
        f"{usual:.2f} mm with as many random ones"
    )
    with output_folder.one_file(out) as new:
        text = plans_text(description.joint_names, [found.remedy("geometry", why)])
        new.write_text(text, encoding="utf-8", newline="\n")
    if campaign is not None:
        with output_folder.one_file(campaign) as new:
            yaml_file.write(new, recording(scenario, found))
    if play is not None:
        chain = found.task.model.nominal
        slides = [chain.is_prismatic(joint) for joint in description.joint_names]
        tour = played(description.joint_names, found.postures, chain.limits, slides)
        with output_folder.updating(play, PLAYED) as new:
            tour.write(new)
    return Designed(found, against)


def with_base_motions(scenario: "Scenario", folder: Path) -> "tuple[Scenario, BasePlan]":
    """The scenario with BASE_MOTIONS calibration motions that show its wheels, written to a folder as CSV.

    Raises:
        NotEnoughData: The robot has no wheels, or hardly any posture clear of itself and in sight.
        ScenarioError: The folder cannot be written.
    """
    import mjcf
    from calibration.design import base_motions
    from twin.campaign import describe_dataset
    from twin.random_streams import generator

    rng = generator(scenario.seed, "design of base motions")
    found = base_motions(mjcf.urdf(), describe_dataset(scenario.twin, ()), BASE_MOTIONS, rng)
    names = [f"base_{k + 1}" for k in range(len(found.motions))]
    with output_folder.updating(folder, tuple(f"{name}.csv" for name in names)) as new:
        for name, motion in zip(names, found.motions, strict=True):
            rows, header = np.column_stack([motion.t, motion.q]), ",".join(("t", *found.joints))
            np.savetxt(new / f"{name}.csv", rows, "%.6f", ",", header=header, comments="", encoding="utf-8")
    motions: dict[str, Any] = dict(scenario.twin.campaign.motions)
    motions |= {name: {"file": str(folder / f"{name}.csv"), "role": "calibration"} for name in names}
    changed = replace(scenario.twin.campaign, motions=motions)
    return scenario.model_copy(update={"twin": replace(scenario.twin, campaign=changed)}), found


def _work() -> "Sample":
    """Draws postures as the twin's campaigns do: in front of the robot, the hand in sight."""
    import mjcf
    from twin.motions import sample_postures

    nominal = mjcf.model()

    def draw(n: int, rng: np.random.Generator) -> np.ndarray:
        return rng.permutation(sample_postures(nominal, n, rng))

    return draw


def recording_too(scenario: "Scenario", file: Path) -> "Scenario":
    """The scenario with the postures of a file after its own calibration postures, each reached from its side.

    Raises:
        InputError: It is no file of postures and motions.
        ScenarioError: It is of another robot, or asks for no posture.
    """
    import mjcf
    from calibration.recording import read_plans
    from twin.motions import JOINTS, RATE, schedule

    joints, remedies = read_plans(file)
    asked = [p for r in remedies for p in r.postures]
    if joints != JOINTS:
        raise ScenarioError(f"{file}: joints are {list(joints)}; the twin has {list(JOINTS)}")
    if not asked:
        raise ScenarioError(f"{file}: contains no posture; motions are recorded by hand, see its `motions`")
    campaign = scenario.twin.campaign
    own = schedule(replace(campaign, only=("postures",)), mjcf.model(), scenario.seed)[0]
    rests = [tuple(map(float, own.command[round(stop * RATE)])) for _, stop in own.dwells]
    sides = campaign.given_approaches or ((0,) * len(JOINTS),) * len(rests)
    try:
        return _with_postures(scenario, (*rests, *(p.q for p in asked)), (*sides, *(p.approach for p in asked)))
    except ValidationError as error:
        beyond = [f"{file}: {found['msg']} (got {found['input']})" for found in error.errors()]
        raise ScenarioError("\n".join(beyond)) from error


def recording(scenario: "Scenario", plan: "Plan") -> "Scenario":
    """The scenario with the postures of a plan as its calibration postures, each reached from the side it says."""
    return _with_postures(scenario, tuple(p.q for p in plan.postures), tuple(p.approach for p in plan.postures))


def _with_postures(scenario: "Scenario", given: Any, sides: Any) -> "Scenario":
    """The scenario with these calibration postures (n, 8), each reached from its side (n, 8)."""
    changed = replace(scenario.twin.campaign, given_postures=given, given_approaches=sides)
    return scenario.model_copy(update={"twin": replace(scenario.twin, campaign=changed)})
