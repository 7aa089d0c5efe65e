"""Every line that a base that sticks and slips must hold, measured on the score.json of runs.

    python -m tests.acceptance.base.base_lines RUN...        prints each line: its figure, its bound, whether it holds

Errors are of the hand by the base alone, joints true, root mean square per component [mm]; a trial is named `jolts`
where its tour is abrupt, `static` where it is soft, `swing` else.
"""

import json
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

JOLTED = "postures_jolts"
TYPES = {"drive kx": "suspension.wheel_right.kx", "front k": "suspension.caster_front_right.kx",
         "front mu": "contact.caster_front_right.mu"}  # fmt: skip
WITHIN = {"drive kx": 0.10, "front k": 0.10, "front mu": 0.15}
OTHERS = ("suspension.wheel_right.ky", "suspension.caster_back_right.kx", "contact.caster_back_right.mu")


@dataclass(frozen=True)
class Line:
    """A figure with its bounds.

    Attributes:
        name: What is measured.
        value: The figure.
        least: At least.
        most: At most.
        figures: One a robot or a trial, of which it is a summary.
    """

    name: str
    value: float
    least: float = -np.inf
    most: float = np.inf
    figures: tuple[float, ...] = ()

    @property
    def holds(self) -> bool:
        """Whether the figure is within its bounds."""
        return bool(self.least <= self.value <= self.most)


def lines(scores: Sequence[dict]) -> Iterator[Line]:
    """Every line that the runs show."""
    for source, (median, worst) in {"plate": (0.25, 0.6), "dynamics": (0.45, 0.9)}.items():
        moving = [_pooled(_trials(s, source, "swing")) for s in scores]
        yield _of("median", f"swing/{source}", moving, most=median)
        yield _of("max", f"swing/{source}", moving, most=worst)
    r2 = [t["yaw_r2"] for s in scores for t in _trials(s, "plate", "swing")]
    yield Line("share of swings with yaw R2 of .95", _share(np.array(r2) >= 0.95), least=0.9, figures=tuple(r2))
    static = [_pooled(t) for s in scores if (t := _trials(s, "plate", "static"))]
    if static:
        yield _of("median", "static/plate", static, most=0.6)
    yield from _after_jolts([t for s in scores for t in _trials(s, "plate", "jolts")])
    for kind in ("swing", "static", "jolts"):
        found = [t for s in scores for t in _trials(s, "plate", kind)]
        if found:
            share = np.average([t["inside_95"] for t in found], weights=[t["n"] for t in found])
            inside = tuple(t["inside_95"] for t in found)
            yield Line(f"share in the 95 % band, {kind}", float(share), 0.90, 0.98, inside)
    yield from _wheels(scores)


def _after_jolts(found: Sequence[dict]) -> Iterator[Line]:
    if not found:
        return
    known = [t for t in found if t["predictable"]]
    yield Line("share of tours after jolts that are predictable", len(known) / len(found), least=0.5)
    if known:
        yield _of("median", "jolts/plate, where predictable", [t["hand_mm"] for t in known], most=1.0)
    worse = [t["hand_mm"] / t["still_mm"] for t in found if not t["predictable"]]
    if worse:
        yield _of("max", "jolts/plate over a base that stays, elsewhere", worse, most=1.1)


def _wheels(scores: Sequence[dict]) -> Iterator[Line]:
    for name, key in TYPES.items():
        rows = [p for s in scores for p in _slip_parameters(s) if p["name"] == key]
        known = [p for p in rows if p["status"] == "estimated"]
        yield Line(f"{name} estimated, share of robots", len(known) / max(len(rows), 1), least=0.9)
        if known:
            off = [abs(p["estimate"] / p["truth"] - 1.0) for p in known]
            yield _of("median", f"{name} off by, share", off, most=WITHIN[name])
    rows = [p for s in scores for p in _slip_parameters(s) if p["name"] in (*TYPES.values(), *OTHERS)]
    inside = [abs(p["estimate"] - p["truth"]) <= 1.96 * p["sigma"] for p in rows if p["status"] == "estimated"]
    if inside:  # 97 at most is of 200 robots and more
        yield Line("95 % intervals of wheel parameters", _share(inside), least=0.93)


def _trials(score: dict, source: str, kind: str) -> list[dict]:
    return [t for t in score["slip"] if t["source"] == source and _kind(t) == kind]


def _kind(trial: dict) -> str:
    return "jolts" if trial["trial"] == JOLTED else trial["kind"]


def _slip_parameters(score: dict) -> list[dict]:
    return [p for p in score["parameters"] if p["model"] == "stick_slip" and p["truth"] is not None]


def _pooled(trials: Sequence[dict]) -> float:
    return float(np.sqrt(np.average([t["hand_mm"] ** 2 for t in trials], weights=[t["n"] for t in trials])))


def _of(summary: str, name: str, figures: Iterable[float], most: float) -> Line:
    found = tuple(figures)
    return Line(f"{summary} of {name}", float(getattr(np, summary)(found)), most=most, figures=found)


def _share(rows: Iterable[bool]) -> float:
    return float(np.mean(list(rows)))


def main() -> None:
    """Print the lines of the run folders that are named."""
    scores = [json.loads((Path(run) / "score.json").read_text(encoding="utf-8")) for run in sys.argv[1:]]
    for line in lines(scores):
        bound = f"[{line.least:g}, {line.most:g}]"
        print(f"{'holds ' if line.holds else 'BROKEN'} {line.value:7.3f} {bound:14} {line.name}")


if __name__ == "__main__":
    main()
