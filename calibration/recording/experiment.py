"""What to record: postures and motions, with what they would identify, as a YAML file.

schema: 1
joints: [torso_lift_joint, arm_1_joint, ...]           columns of q and approach
remedies:
- stage: geometry                                      who asks
  why: ...
  postures:                                            each q [rad, m]; approach -1, 0, 1: sign of each joint's
  - {q: [...], approach: [...]}                        last motion before it rests, 0 where it does not matter
  motions:
  - {kind: drive, ...}                                 fields of `Motion`, SI units
  sigma:                                               standard deviations as predicted
  - {name: geometry.arm_1_joint.x, unit: m, before: 2.0e-3, after: 3.0e-4}
"""

import io
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass
from ruamel.yaml import YAML

from calibration.errors import InputError
from calibration.untrusted import findings, read_text, yaml_of

_STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)


@dataclass(frozen=True, config=_STRICT)
class Posture:
    """A posture to rest in: positions of the measured joints [rad, m], and from which side each comes."""

    q: tuple[float, ...]
    approach: tuple[Literal[-1, 0, 1], ...]


@dataclass(frozen=True, config=_STRICT)
class Motion:
    """A trial of another kind.

    Attributes:
        kind: As in dataset.json: the base spins or drives, resting every `step`; a joint sweeps; all joints swing.
        rests: How many, of a spin or drive.
        step: Between rests, turn [rad] or way [m].
        joint: That sweeps; empty: the base moves, or all joints do as in the recorded swings.
        repeats: How many trials of it.
        amplitude: About the middle of the joint's range [rad, m].
        frequency: Of its sine [Hz].
        seconds: How long it lasts.
    """

    kind: Literal["spin", "drive", "sweep", "swing"]
    rests: int = 0
    step: float = 0.0
    joint: str = ""
    repeats: int = 0
    amplitude: float = 0.0
    frequency: float = 0.0
    seconds: float = 0.0


@dataclass(frozen=True, config=_STRICT)
class Sigma:
    """Standard deviation of a parameter before and, as predicted, after what is to be recorded."""

    name: str
    unit: str
    before: float
    after: float


@dataclass(frozen=True, config=_STRICT)
class ExperimentPlan:
    """What to record for one purpose, and what it would identify."""

    stage: str
    why: str
    postures: tuple[Posture, ...] = ()
    motions: tuple[Motion, ...] = ()
    sigma: tuple[Sigma, ...] = ()


class _File(BaseModel):
    model_config = ConfigDict(extra="forbid")
    schema_version: Literal[1]
    joints: tuple[str, ...]
    remedies: tuple[ExperimentPlan, ...]


def plans_text(joints: Sequence[str], remedies: Sequence[ExperimentPlan]) -> str:
    """The file."""
    yaml = YAML(typ="rt", pure=True)
    yaml.width, yaml.default_flow_style = 4096, None
    text = io.StringIO()
    yaml.dump({"schema": 1, "joints": list(joints), "remedies": [_plain(asdict(r)) for r in remedies]}, text)
    return text.getvalue()


def _plain(value: Any) -> Any:
    """Lists for tuples; a remedy's or motion's empty fields left out."""
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items() if v not in ((), "") and not (k != "approach" and v == 0)}
    return [_plain(v) for v in value] if isinstance(value, tuple | list) else value


def read_plans(path: Path | str) -> tuple[tuple[str, ...], tuple[ExperimentPlan, ...]]:
    """Joints and remedies of a file.

    Raises:
        InputError: It is not such a file.
    """
    found = yaml_of(read_text(path), path)
    if not isinstance(found, dict):
        raise InputError(path, "not a file of postures and motions")
    try:
        named = {"schema_version" if name == "schema" else str(name): value for name, value in found.items()}
        file = TypeAdapter(_File).validate_python(named)
    except ValidationError as error:
        raise InputError(path, findings(error, "file")) from error
    wrong = [
        i for r in file.remedies for i, p in enumerate(r.postures) if {len(p.q), len(p.approach)} != {len(file.joints)}
    ]
    if wrong:
        raise InputError(path, f"postures {wrong} do not have a value for each of {len(file.joints)} joints")
    return file.joints, file.remedies
