"""How large an effect that no model has must be to be seen: robots as `matched_run` makes them, with one effect added.

    dq_j = s x_j      joints that turn;      s of `SIZES` [rad], fixed beforehand; 0: the share seen is the false alarms
    x: time  -1/2 .. 1/2 in the order of recording       reversal  sign of the approach
       load  torque of gravity over its largest          posture   cos q_j

Seen are effects as `mismatch` tests them, all together at 1 %; an effect seen under another name alone is misnamed.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Literal

import numpy as np

from calibration.robot import Chain
from calibration.stages.geometry import calibrate_geometry
from scenarios.files.scenario import Scenario
from scenarios.studies.matched_run import matched_robot
from scenarios.studies.statistics import Interval, share

Name = Literal["time", "reversal", "load", "posture"]
SIZES = (0.0, 5e-4, 1e-3, 2e-3, 4e-3, 8e-3)
_POWER = 0.8
_LOADED = 1e-3  # [N.m] torque that counts as none


@dataclass(frozen=True)
class Power:
    """Robots with an effect of one size.

    Attributes:
        effect: Its name.
        size_mrad: s.
        hand_mm: Root mean square displacement of the hand by it.
        n: Number of robots.
        seen: Share in which it is seen by its name; of none, in which any is [-].
        misnamed: Share in which another one is seen alone [-].
    """

    effect: str
    size_mrad: float
    hand_mm: float
    n: int
    seen: Interval
    misnamed: Interval


def power(scenario: Scenario, effect: Name, n: int, sizes: Sequence[float] = SIZES) -> tuple[Power, ...]:
    """One of each size, of n robots with successive seeds."""
    return tuple(_at(scenario, effect, n, size) for size in sizes)


def smallest(found: Sequence[Power]) -> float:
    """Displacement of the hand [mm] from which on every larger effect is seen in four of five robots; NaN: none."""
    least = np.nan
    for one in sorted(found, key=lambda p: -p.size_mrad):
        if one.size_mrad == 0.0 or one.seen.value < _POWER:
            break
        least = one.hand_mm
    return least


def entry(found: Sequence[Power]) -> dict[str, object]:
    """As study.json has it."""
    least = smallest(found)
    seen = None if np.isnan(least) else least
    return {"schema": 1, "levels": [asdict(p) for p in found], "smallest_seen_mm": seen}


def _at(scenario: Scenario, effect: Name, n: int, size: float) -> Power:
    named, others, moved = 0, 0, []
    for k in range(n):
        one = scenario.model_copy(update={"seed": scenario.seed + k})
        robot = matched_robot(one, partial(_angles, effect, size))
        tests = calibrate_geometry(robot.chain, robot.description, robot.seen)[0].tests
        seen = [t.name for t in tests if t.seen]
        mine = bool(seen) if size == 0.0 else effect in seen
        named, others = named + mine, others + (bool(seen) and not mine)
        q = robot.seen.q
        shift = robot.true.poses(q + _angles(effect, size, robot.chain, q)) - robot.true.poses(q)
        moved.append(float((shift[:, :3, 3] ** 2).sum(axis=1).mean()))
    return Power(effect, 1e3 * size, 1e3 * float(np.sqrt(np.mean(moved))), n, share(named, n), share(others, n))


def _angles(effect: Name, size: float, chain: Chain, q: np.ndarray) -> np.ndarray:
    """(n, k) angles beside readings q (n, k) of the chain's joints."""
    turns = np.array([not chain.is_prismatic(name) for name in chain.joints])
    tau = chain.gravity_torques(q)
    shapes = {
        "time": np.linspace(-0.5, 0.5, len(q))[:, None] * np.ones(q.shape[1]),
        "reversal": np.sign(np.diff(q, axis=0, prepend=q[:1])),
        "load": tau / np.maximum(np.abs(tau).max(axis=0), _LOADED),
        "posture": np.cos(q),
    }
    return size * np.where(turns, shapes[effect], 0.0)
