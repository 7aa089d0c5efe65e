"""How much of each joint's discrepancy its model explains, by regime, and in a sentence where it helps.

The model helps a joint where the rms is cut by a tenth or more, and harms it where the rms grows.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from scenarios.report.results.result_files import Regime

REGIMES = {
    "repetition": "The same motions again, settled, by models fitted to other repetitions",
    "start_stop": "Starts and stops of those motions",
    "unseen_motion": "Other motions, held out",
    "static": "Static postures, held out",
}
_HELPS = 10.0  # [%]


@dataclass(frozen=True)
class RegimeRows:
    """One regime: what it is, its rows by joint, and where the model helps in a sentence."""

    meaning: str
    rows: tuple[Regime, ...]
    sentence: str


def by_regime(regimes: Sequence[Regime]) -> tuple[RegimeRows, ...]:
    """The regimes there are, the model's own first; others than ours by their name."""
    names = dict.fromkeys((*REGIMES, *(r.regime for r in regimes)))
    groups = ((REGIMES.get(name, name), tuple(r for r in regimes if r.regime == name)) for name in names)
    return tuple(RegimeRows(meaning, rows, _sentence(meaning, rows)) for meaning, rows in groups if rows)


def _sentence(meaning: str, rows: Sequence[Regime]) -> str:
    cuts = [r.cut_percent for r in rows if r.cut_percent >= _HELPS]
    harmed, as_it_was, hardly = (
        ", ".join(r.joint.removesuffix("_joint") for r in rows if chosen(r))
        for chosen in (
            lambda r: r.cut_percent < 0.0,
            lambda r: r.cut_percent == 0.0,
            lambda r: 0.0 < r.cut_percent < _HELPS,
        )
    )
    text = f"{meaning}: the rms falls by 10 % or more in {len(cuts)} of {len(rows)} joints"
    if cuts:
        text += f" (by {min(cuts):.0f} to {max(cuts):.0f} %)" if len(cuts) > 1 else f" (by {cuts[0]:.0f} %)"
    text += f", by less in {hardly}" if hardly else ""
    text += f", grows in {harmed}" if harmed else ""
    return text + (f", is left as it is in {as_it_was}." if as_it_was else ".")
