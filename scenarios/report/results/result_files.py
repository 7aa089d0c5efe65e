"""What a report reads of evaluation.json, score.json, scenario.yaml and truth.json; other fields are left out."""

from pydantic import BaseModel, ConfigDict


class Entry(BaseModel):
    """Frozen; what other versions add is left out."""

    model_config = ConfigDict(frozen=True, extra="ignore")


class AxisErrors(Entry):
    """RMSE along the lab's axes [mm]."""

    x: float
    y: float
    z: float


class Row(Entry):
    """A row of evaluation.json or score.json; see the contract for its figures."""

    model: str
    trials: str
    base: str
    encoder: str
    against: str
    n: int
    position_rmse_component_mm: float
    position_rmse_norm_mm: float
    position_p95_norm_mm: float
    position_max_norm_mm: float
    orientation_rmse_deg: float | None
    orientation_max_deg: float | None
    per_axis_mm: AxisErrors
    skill: float | None = None

    @property
    def key(self) -> tuple[str, str, str, str]:
        """What the row is about: model, base, encoder, trials."""
        return self.model, self.base, self.encoder, self.trials


class Scored(Entry):
    """A parameter or combination beside its truth, in the unit given."""

    name: str
    unit: str = ""
    truth: float | None = None
    estimate: float | None = None
    sigma: float | None = None
    z: float | None = None
    status: str
    model: str = ""


class Protocol(Entry):
    """A model under a protocol; see `calibration.protocols`."""

    protocol: str
    model: str
    base: str
    encoder: str
    constants_removed: bool
    n: int
    position_rmse_component_mm: float
    orientation_rmse_component_deg: float


class Compared(Entry):
    """A row against another; see `calibration.comparison`."""

    a: tuple[str, str]
    b: tuple[str, str]
    difference_mm: float
    low_mm: float
    high_mm: float
    finding: str
    reason: str = ""


class Regime(Entry):
    """What the model of a joint explains in one regime; see `calibration.joint_regimes`."""

    joint: str
    regime: str
    discrepancy_before_mrad: float
    discrepancy_after_mrad: float
    cut_percent: float
    r2: float
    n: int
    outside_percent: float = 0.0


class Finding(Entry):
    """A finding of the evaluation on its trials; see `calibration.verdict`."""

    stage: str
    verdict: str
    message: str


class TrialErrors(Entry):
    """A row of the ladder in one trial."""

    trial: str
    model: str
    base: str
    encoder: str
    n: int
    position_rmse_component_mm: float
    orientation_rmse_deg: float | None


class Cause(Entry):
    """A cause of the error, and by how much the error falls without it [mm per component]."""

    cause: str
    size_mm: float
    gain_mm: float
    remedy: str = ""


class Budget(Entry):
    """What the error consists of; see `calibration.evaluation`."""

    whole_mm: float
    shares: tuple[Cause, ...]
    next_steps: tuple[Cause, ...]
    sentence: str


class Evaluation(Entry):
    """The whole of evaluation.json."""

    rows: tuple[Row, ...]
    main: Row | None = None
    beside: tuple[Row, ...] = ()
    budget: Budget | None = None
    trials: tuple[TrialErrors, ...] = ()
    regimes: tuple[Regime, ...] = ()
    protocols: tuple[Protocol, ...] = ()
    comparisons: tuple[Compared, ...] = ()
    verdicts: tuple[Finding, ...] = ()


class BaseScore(Entry):
    """R2 of the base's roll and pitch against the truth; see `scenarios.score_base`."""

    source: str
    n: int
    roll_r2: float
    pitch_r2: float


class Score(Entry):
    """The whole of score.json."""

    rows: tuple[Row, ...]
    base: tuple[BaseScore, ...] = ()
    parameters: tuple[Scored, ...] = ()
    combinations: tuple[Scored, ...] = ()
    nees: float | None = None
    dof: int | None = None


class Derived(Entry):
    """What follows from the true parameters; K and C (6, 6), see `calibration.suspension`, None where rigid."""

    K: tuple[tuple[float | None, ...], ...] | None = None
    C: tuple[tuple[float | None, ...], ...] | None = None


class Truth(Entry):
    """What a report shows of truth.json."""

    derived: Derived = Derived()


class ScenarioNote(Entry):
    """What a report shows of scenario.yaml."""

    name: str = ""
    description: str = ""
    seed: int | None = None
    versions: dict[str, str] = {}
