"""How much of each joint's discrepancy its model explains, by regime, and in a sentence where it helps.

A regime helps a joint if the rms is cut by a tenth or more, harms it if the rms grows.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from scenarios.report.entries import Regime

REGIMES = {
    "repetition": "the same motions again, unseen repetitions",
    "unseen": "other motions, unseen",
    "static": "static postures, unseen",
}
_HELPS = 10.0  # [%]


@dataclass(frozen=True)
class JointRegimes:
    """One joint; a regime it was not excited in is None, in the order of `REGIMES`."""

    joint: str
    found: tuple[Regime | None, ...]


def joint_regimes(regimes: Sequence[Regime]) -> tuple[JointRegimes, ...]:
    """A line for each joint."""
    found = {(r.joint, r.regime): r for r in regimes}
    joints = dict.fromkeys(r.joint for r in regimes)
    return tuple(JointRegimes(j, tuple(found.get((j, regime)) for regime in REGIMES)) for j in joints)


def sentences(regimes: Sequence[Regime]) -> tuple[str, ...]:
    """One for each regime: where it helps, where not."""
    return tuple(_sentence(m, mine) for k, m in REGIMES.items() if (mine := [r for r in regimes if r.regime == k]))


def _sentence(meaning: str, mine: Sequence[Regime]) -> str:
    helped = [r for r in mine if r.cut_percent >= _HELPS]
    harmed = [r.joint.removesuffix("_joint") for r in mine if r.cut_percent < 0.0]
    text = f"{meaning[0].upper()}{meaning[1:]}: the rms falls by 10 % or more in {len(helped)} of {len(mine)} joints"
    if helped:
        low, high = (f(r.cut_percent for r in helped) for f in (min, max))
        text += f" (by {low:.0f} to {high:.0f} %)" if len(helped) > 1 else f" (by {low:.0f} %)"
    return text + (f" and grows in {', '.join(harmed)}." if harmed else ".")
