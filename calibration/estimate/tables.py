"""The exported model as two small texts other programs read.

    zeros.yaml                - joint: NAME            angle = reading - offset            [rad; m where a joint slides]
                                offset: o              ... - compliance * torque - gap / 2 * tanh(torque / 0.3 N.m)
                                compliance: c          [rad/(N.m), m/N], left out where it is 0
                                gap: g                 [rad; m], left out where it is 0
    parameters.csv            name,value,sigma,unit,status,nominal,model, a line each, every model of the estimate

Reading: what the motor-side encoder reports, in the URDF's sense of the joint;
angle: joint position of calibrated.urdf. Who adds offsets to readings has to change their sign.
"""

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass as checked

from calibration.errors import InputError
from calibration.inference.parameters import Model, Parameter
from calibration.robot.hand import HandModel
from calibration.untrusted import findings, read_text, yaml_of

COLUMNS = ("name", "value", "sigma", "unit", "status", "nominal", "model")
_HEADER = """\
# Zeros of the motor-side readings, to be used with calibrated.urdf, whose joint positions are these angles:
#     angle = reading - offset        [rad; m for joints that slide]
"""
_ELASTIC = """\
#     angle = reading - offset - compliance * torque      compliance [rad/(N.m)], torque: that balances gravity
"""
_PLAY = """\
#             - gap / 2 * tanh(torque / 0.3 N.m)          gap [rad], backlash that gravity preloads to one side
"""


@checked(frozen=True, config={"extra": "forbid", "allow_inf_nan": False})
class Zero:
    """What turns a joint's reading into its angle.

    Attributes:
        joint: Its name.
        offset: Reading at angle 0 [rad, m].
        compliance: Of its gear [rad/(N.m), m/N].
        gap: Width of its backlash, which gravity preloads to one side [rad, m].
    """

    joint: str
    offset: float
    compliance: float = 0.0
    gap: float = 0.0


@dataclass(frozen=True)
class Row:
    """A line of parameters.csv; see `estimate.Parameter`."""

    name: str
    value: float
    sigma: float
    unit: str
    status: str
    nominal: float
    model: str


def zeros_text(hand: HandModel) -> str:
    """zeros.yaml of a calibrated robot."""
    plays = bool(hand.gap.any())
    lines = [_HEADER + (_ELASTIC if plays or hand.compliance.any() else "") + (_PLAY if plays else "")]
    for name, *values in zip(hand.chain.joints, hand.offset, hand.compliance, hand.gap, strict=True):
        lines.append(f"- joint: {name}\n  offset: {float(values[0])!r}\n")
        lines += [f"  {key}: {float(x)!r}\n" for key, x in zip(("compliance", "gap"), values[1:], strict=True) if x]
    return "".join(lines)


def read_zeros(path: Path | str) -> tuple[Zero, ...]:
    """Read zeros.yaml, a mapping of joints to offsets, or a CSV table with the columns joint, offset.

    Raises:
        InputError: It is not such a list.
    """
    try:
        text = read_text(path)
        if Path(path).suffix.lower() == ".csv":
            entries = [
                {k: v for k, v in row.items() if v not in (None, "")} for row in csv.DictReader(io.StringIO(text))
            ]
        else:
            entries = yaml_of(text, path)
        if isinstance(entries, dict):
            entries = [{"joint": joint, "offset": offset} for joint, offset in entries.items()]
        return TypeAdapter(tuple[Zero, ...]).validate_python(entries)
    except ValidationError as error:
        raise InputError(path, findings(error, "file")) from error
    except csv.Error as error:
        raise InputError(path, f"not a list of joints and offsets ({error})") from error


def zero_parameters(zeros: Sequence[Zero]) -> tuple[Parameter, ...]:
    """The zeros as parameters of a model; whoever made them states no standard deviation."""
    found = []
    for z in zeros:
        values = (
            ("encoder", "motor.offset", z.offset),
            ("gear", "compliance", z.compliance),
            ("backlash", "gap", z.gap),
        )
        found += [
            Parameter(f"{kind}.{z.joint}.{name}", "", 0.0, value, 0.0, "estimated")
            for kind, name, value in values
            if value or kind == "encoder"
        ]
    return tuple(found)


def parameters_text(models: Sequence[Model]) -> str:
    """parameters.csv of these models; numbers read back to the same doubles."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for model in models:
        for p in model.parameters:
            writer.writerow([p.name, repr(p.value), repr(p.sigma), p.unit, p.status, repr(p.nominal), model.name])
    return text.getvalue()


def read_parameters(path: Path | str) -> tuple[Row, ...]:
    """Read parameters.csv.

    Raises:
        InputError: It is not such a table.
    """
    try:
        with Path(path).open(encoding="utf-8", newline="") as file:
            return TypeAdapter(tuple[Row, ...]).validate_python([dict(row) for row in csv.DictReader(file)])
    except ValidationError as error:
        lines = [f"line {int(e['loc'][0]) + 2}, {e['loc'][-1]}: {e['msg']}" for e in error.errors()]
        raise InputError(path, "; ".join(lines)) from error
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(path, f"cannot be read ({error})") from error
