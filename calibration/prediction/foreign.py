"""An estimate of another program on one of our datasets: names, units and joints checked, marker frames registered.

Every name must be one of the contract's for this robot. A model that places the hand becomes a row under its own name.
A URDF does not contain the marker bodies' frames: both are fitted to the static calibration postures, all else as
submitted.
"""

import re
from collections.abc import Iterator
from dataclasses import replace
from difflib import get_close_matches

import numpy as np

from calibration.errors import CalibrationError, InputError
from calibration.estimate.estimate import Estimate
from calibration.inference.parameters import Model, Parameter
from calibration.mocap.postures import Postures
from calibration.prediction.recordings import clocks_of, static
from calibration.recording.dataset import Dataset
from calibration.recording.schema import Description
from calibration.robot.chain import Chain, chain_of
from calibration.robot.hand import HandModel
from calibration.robot.laboratory import Laboratory
from calibration.stages.geometry.hand_residual import NoiseModel
from calibration.stages.geometry.model_of_fit import hand_of
from calibration.stages.geometry.parameters import (
    hand_model,
    reading_floor,
    reading_sigma,
    registration_parameters,
)
from calibration.stages.geometry.stage import fit_robustly
from calibration.verdict import Verdict

_AXIS = "(x|y|z|rx|ry|rz)"
_FREE = re.compile(  # of the contract, without effect on the hand's place
    r"(friction\.\w+\.(coulomb|viscous)|sigmoid\.\w+\.\w+|suspension\.\w+\.\w+|slip\.\w+(\.\w+\.[kdc])?|flexibility\.\w+\.kr?[xyz]|contact\.\w+\.\w+"
    r"|link\.\w+\.(mass|cx|cy|cz)|payload\.(mass|cx|cy|cz)|marker\.\w+\.[xyz]|plate\.\w+\.\w+"
    r"|clock\.\w+\.(offset|drift)|encoder\.\w+\.(motor|link)\.(offset|cos1|sin1|cos2|sin2)"
    r"|(gear|hysteresis)\.\w+\.\w+|backlash\.\w+\.gap|drive\.\w+\.\w+)"
)
_FRAME = re.compile(rf"frame\.(\w+)\.(\w+)\.{_AXIS}")
_FRAMES = {"lab", "base", "arm", "tool", "hand", "plate"}
_JOINT = re.compile(r"(geometry|encoder|gear|hysteresis|backlash|friction|sigmoid)\.(\w+)\.")
_STATIC = ("encoder", "gear", "backlash")
_LARGEST = {"m": 0.5, "rad": 1.6}  # a value beyond it is of another unit


def places_hand(model: Model, chain: Chain) -> bool:
    """Whether a model has parameters that move the hand on the robot, more than the base's marker frame."""
    names = set(hand_model(chain, np.zeros(12)).names)
    return any(p.name in names and not p.name.startswith("frame.base.") for p in model.parameters)


def check_names(estimate: Estimate, dataset: Dataset) -> tuple[Verdict, ...]:
    """Warnings of parameters that no row uses.

    Raises:
        InputError: A name, a joint or a unit is not one of the contract's for this robot; all findings at once.
    """
    chain, joints = chain_of(dataset.urdf, dataset.description), dataset.description.joint_names
    frames = _FRAMES | {body.name for body in dataset.description.bodies} | {f.name for f in chain.nominal.frames}
    hand = hand_model(chain, np.zeros(12))
    units = {name: unit for block in hand.blocks for name, unit in zip(block.names, block.units, strict=True)}
    findings, unused = [], set()
    for model in estimate.models:
        for p in model.parameters:
            findings += [f"{model.name}: {text}" for text in _faults(p, units, joints, frames)]
            if p.name not in units and p.name.startswith(_STATIC) and estimate.robot is None:
                unused.add(p.name)
    if findings:
        raise InputError("estimate", "; ".join(findings))
    if not unused:
        return ()
    return (Verdict("evaluation", "warning", f"no row uses {', '.join(sorted(unused))}"),)


def _faults(p: Parameter, units: dict[str, str], joints: tuple[str, ...], frames: set[str]) -> Iterator[str]:
    joint, frame = _JOINT.match(p.name), _FRAME.fullmatch(p.name)
    if joint and joint.group(2) not in joints:
        yield f"{p.name}: no joint {joint.group(2)!r}{_nearest(joint.group(2), joints)}"
    elif p.name not in units and not (_FREE.fullmatch(p.name) or (frame and frames.issuperset(frame.group(1, 2)))):
        yield f"{p.name}: no such parameter{_nearest(p.name, tuple(units))}"
    elif p.unit and p.unit != units.get(p.name, p.unit):
        yield f"{p.name}: unit {p.unit!r}; it must be {units[p.name]!r}"
    elif not p.name.startswith("frame.") and abs(p.value) > _LARGEST.get(units.get(p.name, ""), np.inf):
        yield f"{p.name}: {p.value:g} {units[p.name]} is no calibration's; values are in m and rad, not mm or degrees"


def _nearest(name: str, known: tuple[str, ...]) -> str:
    near = get_close_matches(name, known, 1, 0.0)
    return f"; the nearest known is {near[0]!r}" if near else ""


def registered(estimate: Estimate, dataset: Dataset) -> Estimate:
    """The estimate with both marker frames of every model fitted to the static calibration postures.

    Raises:
        InputError: Its URDF is of another robot.
        NotEnoughData: No calibration posture shows base and hand.
    """
    lab = Laboratory(dataset.urdf, dataset.description)
    chain, clocks = _chain(estimate, dataset), clocks_of(dataset)
    postures = static(dataset, "calibration", clocks)
    models = []
    for model in estimate.models:
        hand = hand_of(model, chain, lab.nominal_frames)
        models.append(_with(model, _fitted_frames(hand, chain, lab.description, postures)))
    zeros = any(p.name.startswith("encoder.") for model in estimate.models for p in model.parameters)
    message = f"marker frames registered on {len(postures.q)} calibration postures"
    message += "; a URDF has none" if zeros else ", encoder zeros 0; a URDF has neither (zeros: --zeros FILE)"
    verdicts = (*estimate.verdicts, Verdict("evaluation", "ok", message))
    return replace(estimate, models=tuple(models), clocks=estimate.clocks or clocks, verdicts=verdicts)


def _fitted_frames(
    hand: HandModel, chain: Chain, description: Description, postures: Postures
) -> tuple[Parameter, ...]:
    """Both frames, all else of the hand fixed; readings err by the datasheet's backlash, as far as the data agree."""
    frames, floor = registration_parameters(chain, description), reading_floor(chain, description)
    identified = np.arange(len(frames)) < 6 + postures.components  # a point does not show how the hand is turned
    frames = replace(frames, tolerance=np.where(identified, np.inf, description.tolerances.body_rotation))
    noise = NoiseModel(np.maximum(reading_sigma(chain, description), floor), floor, np.zeros(0), stated=True)
    values = fit_robustly(hand, frames, postures, noise).fit.theta
    rows = zip(frames.names, frames.units, values, strict=True)
    return tuple(Parameter(name, unit, 0.0, float(x), 0.0, "estimated") for name, unit, x in rows)


def _with(model: Model, added: tuple[Parameter, ...]) -> Model:
    n = len(model.parameters) + len(added)
    return replace(model, parameters=(*model.parameters, *added), covariance=np.zeros((n, n)))


def _chain(estimate: Estimate, dataset: Dataset) -> Chain:
    try:
        return chain_of(estimate.urdf or dataset.urdf, dataset.description)
    except (CalibrationError, ValueError, RuntimeError) as error:
        raise InputError(estimate.main, f"not a URDF of this robot: {error}") from error
