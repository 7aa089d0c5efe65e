"""Whether one row of the ladder is better than another: a paired bootstrap over blocks of the held-out dynamic trials.

    d = RMSE_b - RMSE_a [mm per component]      negative: b is better

Errors of neighbouring samples are alike, so whole blocks of `_BLOCK` seconds are resampled, the same for both rows.
Reference: Kuensch, Annals of Statistics 1989 (block bootstrap).

Why a model that only moves the base is better or worse than `nominal`, in one sentence of measured figures.

    e_fixed = e + b        e error of the nominal hand with the base measured, b what the base moved the hand by
    mean e_fixed^2 - mean e^2 = mean b^2 + 2 mean e.b

The base's motion taken off exactly lowers the error only if b^2 outweighs -2 e.b: where the hand's own errors are
larger and happen to point against b, the right motion of the base makes the hand worse.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calibration.estimate.rows import LADDER, NOMINAL, row_of
from calibration.evaluation.ladder import TrialErrors

_BLOCK = 2.0  # [s]
_DRAWS = 2000
_SEED = 20241122  # of the bootstrap alone: the same traces give the same interval
Key = tuple[str, str]


@dataclass(frozen=True)
class Comparison:
    """Row b against row a, motor encoders, dynamic trials.

    Attributes:
        a: Model and base of the reference.
        b: Model and base of the other.
        difference_mm: RMSE of b minus RMSE of a, per component [mm].
        low_mm: 2.5th percentile of the bootstrap [mm].
        high_mm: 97.5th percentile [mm].
        blocks: Number of blocks.
        finding: `better`, `worse` or `no difference`, of b.
        reason: Why, in one sentence, where `b` moves the base and nothing else; empty else.
    """

    a: Key
    b: Key
    difference_mm: float
    low_mm: float
    high_mm: float
    blocks: int
    finding: str
    reason: str = ""


def comparisons(traces: Sequence[TrialErrors]) -> Iterator[Comparison]:
    """The pairs that the ladder is built on, as far as they are there in trials that move."""
    present = {(t.model, t.base) for t in traces if t.encoder == "motor" and t.kind != "static"}
    for a, b, moves_base_only in _pairs():
        if a in present and b in present:
            found = compare(traces, a, b)
            reason = base_reason(_base_errors(traces, b), found.finding) if moves_base_only else ""
            yield replace(found, reason=reason)


def _pairs() -> Iterator[tuple[Key, Key, bool]]:
    """Each row with the one it builds on, by source of the base's motion; whether nothing but the base differs."""
    for row in (r for r in LADDER if r.builds_on is not None):
        before = row_of(str(row.builds_on))
        for base in (b for b in ("plate", "dynamics") if b in row.bases):
            yield (before.name, base if base in before.bases else "fixed"), (row.name, base), row.needs_suspension


def compare(traces: Sequence[TrialErrors], a: Key, b: Key) -> Comparison:
    """One pair."""
    sums = np.concatenate(list(_blocks(traces, a, b)))  # squared error of a, of b, number of components
    rows = np.random.default_rng(_SEED).integers(len(sums), size=(_DRAWS, len(sums)))
    low, high = np.percentile(_difference(sums[rows].sum(axis=1)), [2.5, 97.5])
    finding = "better" if high < 0.0 else "worse" if low > 0.0 else "no difference"
    whole = float(_difference(sums.sum(axis=0)[None])[0])
    return Comparison(a, b, whole, float(low), float(high), len(sums), finding)


def _base_errors(traces: Sequence[TrialErrors], b: Key) -> dict[str, np.ndarray]:
    """Errors (n, 3) [m] of the nominal hand by where the base's motion came from, where all three are known."""
    rows = {"fixed": (NOMINAL, "fixed"), "measured": (NOMINAL, "measured"), "predicted": b}
    kept = {key: [t for t in traces if (t.model, t.base, t.encoder) == (*key, "motor")] for key in rows.values()}
    e = {
        name: np.concatenate([t.scored.position for t in kept[key] if t.kind != "static"])
        for name, key in rows.items()
        if any(t.kind != "static" for t in kept[key])
    }
    if len(e) < len(rows) or len({len(x) for x in e.values()}) > 1:
        return {}
    good = np.isfinite(np.concatenate(list(e.values()), axis=1)).all(axis=1)
    return {name: x[good] for name, x in e.items()}


def _difference(sums: np.ndarray) -> np.ndarray:
    """RMSE of b minus RMSE of a [mm] from sums (n, 3)."""
    return np.asarray(1e3 * (np.sqrt(sums[:, 1] / sums[:, 2]) - np.sqrt(sums[:, 0] / sums[:, 2])))


def _blocks(traces: Sequence[TrialErrors], a: Key, b: Key) -> Iterator[np.ndarray]:
    for trial in dict.fromkeys(t.trial_id for t in traces if t.kind != "static"):
        pair = [
            next(t for t in traces if (t.trial_id, t.model, t.base, t.encoder) == (trial, *key, "motor"))
            for key in (a, b)
        ]
        e = np.stack([t.scored.position for t in pair], axis=1)
        rate = (len(pair[0].t) - 1) / (pair[0].t[-1] - pair[0].t[0])
        for part in np.array_split(e, max(1, round(len(e) / rate / _BLOCK))):
            good = part[np.isfinite(part).all(axis=(1, 2))]
            if len(good):
                yield np.append((good**2).sum(axis=(0, 2)), good[:, 0].size)[None]


def base_reason(errors: Mapping[str, np.ndarray], finding: str) -> str:
    """The sentence, from errors (n, 3) [m] of the nominal hand with the base `fixed`, `measured` and `predicted`.

    Empty where one of them is missing.
    """
    if errors.keys() < {"fixed", "measured", "predicted"}:
        return ""
    fixed, measured, predicted = (errors[name] for name in ("fixed", "measured", "predicted"))
    moved, missed = _rms(fixed - measured), _rms(predicted - measured)
    stays, left = _rms(fixed), _rms(measured)
    moved_by = f"the base moved the hand by {moved:.2f} mm rms per component"
    even = f"with the measured base the error is {left:.2f} mm instead of {stays:.2f}"
    if finding == "worse" and left >= stays:
        return f"{moved_by}, the nominal hand is off by more: even {even}"
    if finding == "worse":
        return f"{moved_by}, its prediction misses that by {missed:.2f} mm; {even}"
    return f"{moved_by}, of which the prediction leaves {missed:.2f} mm; {even}, the rest is nominal geometry"


def _rms(e: np.ndarray) -> float:
    return 1e3 * float(np.sqrt((e**2).mean()))
