"""What a stage is: recordings and the results of earlier stages in, models and findings out.

result = stage.run(data)            data is a value: a stage changes nothing that another one reads
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

from calibration.errors import NotEnoughData
from calibration.inference.parameters import Model
from calibration.mocap.postures import Postures
from calibration.options import Options
from calibration.recording.clock import Clock
from calibration.recording.schema import Kind
from calibration.recording.trial import Trial
from calibration.robot.laboratory import Laboratory
from calibration.verdict import Verdict

T = TypeVar("T")


@dataclass(frozen=True)
class StageInput:
    """Calibration recordings with the results of the stages before.

    Attributes:
        lab: The nominal robot and its setup.
        trials: Continuous trials in which the base stands.
        moves: Spins and drives, in which it does not.
        clocks: Of the instruments.
        postures: Static ones, None where none shows base and hand with readings.
        passing: Those passed in swings, None where there is no swing.
        options: What was chosen.
        models: Estimated so far.
        rejected: Whether an earlier stage rejected its result.
        quantities: What earlier stages estimated beside parameters of models.
    """

    lab: Laboratory
    trials: tuple[Trial, ...] = ()
    moves: tuple[tuple[Kind, Trial], ...] = ()
    clocks: tuple[Clock, ...] = ()
    postures: Postures | None = None
    passing: Postures | None = None
    options: Options = field(default_factory=Options)
    models: tuple[Model, ...] = ()
    rejected: bool = False
    quantities: tuple[object, ...] = ()

    def quantity(self, kind: type[T]) -> T | None:
        """What an earlier stage estimated, by its type; None where none did."""
        return next((q for q in self.quantities if isinstance(q, kind)), None)

    def clock(self, instrument: str) -> Clock | None:
        """The clock of an instrument; None where it was not recorded or could not be estimated."""
        return next((c for c in self.clocks if c.instrument == instrument), None)

    def model(self, name: str) -> Model | None:
        """An estimated model; None where there is none of that name."""
        return next((m for m in self.models if m.name == name), None)

    @property
    def static(self) -> Postures:
        """The static postures.

        Raises:
            NotEnoughData: There are none.
        """
        if self.postures is None:
            raise NotEnoughData("no static posture shows base and hand with joint readings")
        return self.postures

    @property
    def moving(self) -> bool:
        """Whether calibration trials of the arm in motion are declared."""
        kinds = {entry.kind for entry in self.lab.description.trials if entry.role == "calibration"}
        return bool(kinds & {"sweep", "swing"})


@dataclass(frozen=True)
class StageResult:
    """What a stage estimated.

    Attributes:
        models: Rows of the estimate.
        findings: What is to be reported.
        quantity: What the stage estimates beside parameters of models: a `Suspension`, `JointModels`, `Bundle`.
    """

    models: tuple[Model, ...] = ()
    findings: tuple[Verdict, ...] = ()
    quantity: object = None


def has_postures(data: StageInput) -> str:
    """What a stage of static postures lacks; empty where it has it."""
    return "" if data.postures is not None else "it takes joint readings with base and hand markers in static postures"


@dataclass(frozen=True)
class Stage:
    """One step of the calibration.

    Attributes:
        name: As in `calibrate --stages`.
        run: From recordings to a result.
        lacks: What the recordings lack for it; empty where it can run.
        needs: The stage whose result it uses; run with it.
    """

    name: str
    run: Callable[[StageInput], StageResult]
    lacks: Callable[[StageInput], str] = has_postures
    needs: str = ""
