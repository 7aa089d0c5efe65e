"""Estimates as a report shows them: what the data fix, alone or combined, each beside its truth or its nominal value.

error = estimate - truth (or - nominal)         covered: |error| <= 1.96 sigma
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from calibration import Estimate
from calibration.inference import Model
from scenarios.plots.forest import Interval
from scenarios.report.results.formatting import readable
from scenarios.report.results.result_files import Score
from scenarios.report.results.run_results import Results

KINDS = {
    "frame": "marker frames",
    "geometry": "joint placements",
    "encoder": "encoder zeros",
    "backlash": "backlash",
    "gear": "gear compliance",
    "friction": "friction",
    "sigmoid": "sigmoid joint model",
    "suspension": "suspension",
    "slip": "slip of the base",
    "contact": "wheel contact",
    "link": "link masses",
    "payload": "payload",
    "marker": "markers",
    "plate": "force plate",
    "clock": "clocks",
    "flexibility": "bending",
    "log": "robot log",
    "mocap": "motion capture",
    "wrist": "wrist sensor",
}


@dataclass(frozen=True)
class Known:
    """One parameter, or one combination, that the data fix.

    Attributes:
        name: As in the contract.
        terms: Of a combination, `coefficient name` of each other parameter; empty for a parameter.
        unit: Readable one; values are in it.
        reference: Truth, or nominal value.
        estimate: What was found.
        sigma: Its standard deviation.
    """

    name: str
    terms: tuple[str, ...]
    unit: str
    reference: float
    estimate: float
    sigma: float

    @property
    def kind(self) -> str:
        """First part of its name, in words."""
        first = self.name.split(".")[0]
        return KINDS.get(first, first)

    @property
    def error(self) -> float:
        """Estimate minus reference."""
        return self.estimate - self.reference

    @property
    def z(self) -> float:
        """Error over its standard deviation [-]."""
        return self.error / self.sigma

    @property
    def label(self) -> str:
        """A short name for a figure; `+ 3` means three further terms."""
        parts = [part.removesuffix("_joint") for part in self.name.split(".")[1:] if part != "motor"]
        if self.name.startswith("frame.") and len(parts) == 3:
            parts = [f"{parts[0]}→{parts[1]}", parts[2]]
        return " ".join(parts) + (f"  + {len(self.terms)}" if self.terms else "")

    @property
    def interval(self) -> Interval:
        """For the forest plot."""
        return Interval(self.label, self.error, self.sigma)


def known(results: Results) -> tuple[Known, ...]:
    """What the main model's data fix: against the truth where it is known, else against nominal."""
    estimate = results.estimate
    if estimate is None or not estimate.main:
        return ()
    model = estimate.model(estimate.main)
    found = _scored(results.score, model) if results.score else _nominal(model)
    place = {p.name: i for i, p in enumerate(model.parameters)}
    return tuple(sorted((k for k in found if k.sigma > 0.0), key=lambda k: place.get(k.name, len(place))))


def _nominal(model: Model) -> Iterable[Known]:
    """About nominal values; a clock has none worth comparing with."""
    for p in model.parameters:
        if p.status == "estimated" and not p.name.startswith("clock."):
            factor, unit = readable(p.name, p.unit)
            yield Known(p.name, (), unit, factor * p.nominal, factor * p.value, factor * p.sigma)
    units, nominal = {p.name: p.unit for p in model.parameters}, np.array([p.nominal for p in model.parameters])
    for c in model.combinations:
        factor, unit = readable(c.name, units[c.name])
        terms, reference = _terms(c.coefficients, model, c.name), float(c.coefficients @ nominal)
        yield Known(c.name, terms, unit, factor * reference, factor * c.value, factor * c.sigma)


def _scored(score: Score, model: Model) -> Iterable[Known]:
    units = {p.name: p.unit for p in model.parameters}
    terms = {c.name: _terms(c.coefficients, model, c.name) for c in model.combinations}
    alone = ((p, ()) for p in score.parameters if p.status == "estimated" and p.model in ("", model.name))
    for p, others in (*alone, *((c, terms.get(c.name, ())) for c in score.combinations)):
        if p.estimate is not None and p.truth is not None and p.sigma is not None:
            factor, unit = readable(p.name, units.get(p.name, p.unit))
            yield Known(p.name, others, unit, factor * p.truth, factor * p.estimate, factor * p.sigma)


def _terms(coefficients: np.ndarray, model: Model, lead: str) -> tuple[str, ...]:
    """Terms beside the leading one that count, as text."""
    pairs = [(c, p.name) for c, p in zip(coefficients, model.parameters, strict=True) if p.name != lead and c != 0.0]
    return tuple(f"{c:+.3g} {name}".replace("-", "\N{MINUS SIGN}", 1) for c, name in pairs)


def groups(found: Iterable[Known]) -> dict[tuple[str, str], list[Known]]:
    """The same, by kind and unit, kinds in the order of `KINDS`."""
    order = list(KINDS.values())
    ranked = sorted(found, key=lambda k: order.index(k.kind) if k.kind in order else len(order))
    grouped: dict[tuple[str, str], list[Known]] = {}
    for one in ranked:
        grouped.setdefault((one.kind, one.unit), []).append(one)
    return grouped


def coverage(found: Iterable[Known]) -> tuple[int, int]:
    """How many 95 % intervals contain the truth, and of how many."""
    inside = [k.interval.covers for k in found]
    return sum(inside), len(inside)


def left_out(score: Score | None, estimate: Estimate | None) -> dict[str, dict[str, int]]:
    """How many parameters of each kind the data do not fix by themselves, by status."""
    entries = [(p.name, str(p.status)) for p in score.parameters] if score else []
    if not entries and estimate is not None and estimate.main:
        entries = [(p.name, str(p.status)) for p in estimate.model(estimate.main).parameters]
    counts: dict[str, dict[str, int]] = {}
    for name, status in entries:
        if status != "estimated":
            kind = KINDS.get(name.split(".")[0], name.split(".")[0])
            of_kind = counts.setdefault(status, {})
            of_kind[kind] = of_kind.get(kind, 0) + 1
    return counts
