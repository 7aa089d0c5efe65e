"""The ladder: every row that predicts the hand, one entry each.

A row names the geometry that places the hand, whether joint models correct the readings, where the base's motion may
come from and which encoders are read. A new row is one entry here.
"""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

Base = Literal["fixed", "plate", "dynamics", "measured", "submitted"]
Encoder = Literal["motor", "link"]
SOURCES: tuple[Base, ...] = ("plate", "dynamics", "fixed")
"""Of the base's motion without a measured base, the best first."""
_EVERY: tuple[Base, ...] = ("fixed", "plate", "dynamics", "measured")
_MOTOR: tuple[Encoder, ...] = ("motor",)


@dataclass(frozen=True)
class Published:
    """How the paper's public evaluation code scores a row.

    Attributes:
        base: Where the base's motion comes from.
        encoder: Which side of the gear is read.
        constants_removed: Whether the mean error is subtracted along each axis.
    """

    base: Base
    encoder: Encoder
    constants_removed: bool


@dataclass(frozen=True)
class LadderRow:
    """A row of the ladder.

    Attributes:
        name: Of the row.
        meaning: In a few words.
        geometry: Model of the estimate that places the hand; None: the datasheet.
        joints: Whether the joint models correct the motor readings.
        bundle: Whether drive trains correct them, the column bends and the base slips, where those were identified.
        bases: Where the base's motion may come from.
        encoders: Which sides of the gear are read.
        builds_on: Row it is compared with; None: not compared.
        registered: Whether its marker frames are fitted again in another session.
        means: Whether it predicts posture means, which show no motion before the posture.
        published: How the paper scores it; None: not one of the paper's models.
    """

    name: str
    meaning: str
    geometry: str | None
    joints: bool = False
    bundle: bool = False
    bases: tuple[Base, ...] = _EVERY
    encoders: tuple[Encoder, ...] = _MOTOR
    builds_on: str | None = None
    registered: bool = True
    means: bool = False
    published: Published | None = None

    @property
    def needs_suspension(self) -> bool:
        """Whether it is a row only with a suspension: nothing else distinguishes it."""
        return "fixed" not in self.bases

    def predictive_base(self, available: Collection[str]) -> Base | None:
        """The best source of the base's motion but its measurement; None where none is available."""
        return next((b for b in SOURCES if b in self.bases and b in available), None)


NOMINAL = "nominal"
BASELINE = "registration"
"""The row that gains are relative to: marker frames fitted, nothing else."""
LADDER = (
    LadderRow(
        NOMINAL,
        "datasheet geometry, marker bodies at their nominal places",
        None,
        bases=("fixed", "measured"),
        registered=False,
        means=True,
        published=Published("fixed", "motor", constants_removed=False),
    ),
    LadderRow(
        "model_1",
        "nominal and the published suspension",
        None,
        bases=("plate", "dynamics", "measured"),
        builds_on=NOMINAL,
        registered=False,
        published=Published("measured", "motor", constants_removed=False),
    ),
    LadderRow(
        BASELINE, "datasheet geometry, marker bodies fitted: the baseline of every calibration", BASELINE, means=True
    ),
    LadderRow(
        "arm_tool",
        "base frame from spins and drives, then arm base and tool; the arm itself with its factory calibration",
        "arm_tool",
    ),
    LadderRow(
        "model_2",
        "registration and geometric calibration",
        "model_2",
        builds_on=BASELINE,
        means=True,
        published=Published("measured", "motor", constants_removed=True),
    ),
    LadderRow(
        "model_3",
        "model_2 and the published sigmoid-polynomial joint model",
        "model_2",
        joints=True,
        encoders=("motor", "link"),
        builds_on="model_2",
        published=Published("measured", "link", constants_removed=True),
    ),
    LadderRow(
        "full",
        "geometry, physical drive trains and stick-slip base; from posture means: geometry, compliance and backlash",
        "full",
        bundle=True,
        encoders=("motor", "link"),
        means=True,
    ),
)
MAIN = tuple(row.name for row in reversed(LADDER) if row.geometry == row.name)
"""Rows an estimate can be used by, the best first: those with a geometry of their own."""


PARTS = ("base_frame", "drive_trains", "stick_slip")
"""Models of an estimate that are no row: parameters beside a geometry."""


def row_of(name: str) -> LadderRow:
    """The row of a name; of another program's model, one with a geometry of its own."""
    return next((row for row in LADDER if row.name == name), LadderRow(name, "as submitted", name, means=True))
