"""Recordings that are wrong in a laboratory's way: what is done to a good campaign, how bad, what must be named.

A mistake changes trials of a role, or the description, of a campaign in memory. `TABLE` has the rows that are known,
`at_random` makes others of the same kinds: sizes, joints, bodies and times at random.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from tests.hostile.rows.campaign import (
    Spoil,
    commanded,
    commands,
    drawn_off,
    drift,
    exchanged_columns,
    exchanged_sides,
    gain,
    ghosts,
    gone,
    hidden,
    late,
    link,
    lost_plate,
    lost_readings,
    moved,
    scaled,
    shifted_dwells,
    slip,
    validated_on_calibration,
    wrapped,
)

STAGES = ("registration", "geometry")
LINKS = (*STAGES, "joints", "bundle")


@dataclass(frozen=True)
class Mistake:
    """A row.

    Attributes:
        name: What is wrong, and how bad.
        spoil: Makes it so.
        says: Words of a verdict, any of them between `|`; empty where the data remain usable and nothing need be named.
        worst: Largest true error of an estimate that is nevertheless called good, times the clean one [-].
        stages: That calibrate.
        judged: Seen in the recordings alone, before anything is fitted: the fast rows.
    """

    name: str
    spoil: Spoil
    says: str
    worst: float = 2.0
    judged: bool = False
    stages: tuple[str, ...] = STAGES


WRONG_LINK = "arm_3_joint are exchanged, or a link encoder is wrong"
SLIPPED = "elsewhere|slipped|drift|off in scale|late|moved|contradict|did not converge|refused"
FAST = (
    Mistake("markers 1 % too large", scaled(1.01), "times as far apart as in dataset.json", judged=True),
    Mistake("markers 5 % too large", scaled(1.05), "times as far apart as in dataset.json", judged=True),
    Mistake(
        "a hand marker drawn 50 mm off", drawn_off("gripper", [0.0, 0.05, 0.0], 1), "from its drawing", judged=True
    ),
    Mistake("a base marker drawn 20 mm off", drawn_off("base", [0.02, 0.0, 0.0], 2), "from its drawing", judged=True),
    Mistake("a hand marker bumped by 10 mm", moved("gripper", [0.01, 0.0, 0.0], 0.4, 2), "a marker moved", judged=True),
    Mistake("dwells 1 s late", shifted_dwells(1.0), "the hand moves in", judged=True),
    Mistake("commands logged", lambda c: commands(list(range(8)))(commanded()(c)), "are the commands", judged=True),
    Mistake("arm_3 commanded", lambda c: commands([3])(commanded()(c)), "readings of arm_3_joint are the", judged=True),
    Mistake("arm_4 readings lost for 3 s", lost_readings(4, 0.6, 3.0), "holes in the joint readings", judged=True),
)
TABLE = (
    *FAST,
    Mistake("hand drawn 50 mm off", drawn_off("gripper", [0.05, 0.0, 0.0]), "from their nominal place"),
    Mistake("arm_4 gain 3 %", gain(4, 0.03), "arm_4_joint are off in scale"),
    Mistake("arm_2 gain -2 %", gain(2, -0.02), "arm_2_joint are off in scale"),
    Mistake("arm_3 slips by 1 deg", slip(3, 0.0175, 0.5), SLIPPED),
    Mistake("arm_3 drifts by 1 deg", drift(3, 0.0175), SLIPPED),
    *(
        Mistake(f"link of arm_3 {what}", link(3, change, share), f"{says}|{WRONG_LINK}", stages=LINKS)
        for what, change, share, says in (
            ("turned", lambda q, t: -q, -1.0, "arm_3_joint has its sign turned"),
            ("in degrees", lambda q, t: np.degrees(q), -1.0, "arm_3_joint is in degrees"),
            ("5 % too large", lambda q, t: 1.05 * q, -1.0, "1.05 of its motor's scale"),
            ("wraps", lambda q, t: wrapped(q, float(np.nanmedian(q))), -1.0, "arm_3_joint wraps by"),
            ("saturates", lambda q, t: np.minimum(q, np.nanquantile(q, 0.7)), -1.0, "arm_3_joint does not exceed"),
            ("reads arm_2", lambda q, t: t.q_link[:, 2], -1.0, "arm_3_joint follows the motor of"),
            ("slips by 10 mrad", lambda q, t: q + 0.01, 0.5, "encoder of arm_3_joint slips by"),
        )
    ),
    Mistake("readings 50 ms late from half-way on", late(0.05, 0.5), SLIPPED),
    Mistake("hand markers slip by 10 mm", moved("gripper", [0.0, 0.01, 0.0], 0.5), SLIPPED),
    Mistake("base markers slip by 10 mm", moved("base", [0.01, 0.0, 0.0], 0.5), SLIPPED),
    *(
        Mistake(f"motor and link of arm {few} exchanged", exchanged_sides(few), "are exchanged")
        for few in ([1, 2, 3, 4, 5, 6, 7], [6], [1, 2, 3, 4], [1, 2, 5], [3, 5])
    ),
    *(
        Mistake(f"columns of arm_{a} and arm_{b} exchanged", exchanged_columns(a, b), f"arm_{b}_joint are swapped")
        for a, b in combinations(range(1, 5), 2)
    ),
    Mistake("validated on a calibration file", validated_on_calibration, "are one recording"),
    Mistake("1 % of frames lost", hidden(0.01, 0.0), "", 1.1),
    Mistake("20 % hidden in blocks of 0.5 s", hidden(0.2, 0.5), "", 1.1),
    Mistake("20 % hidden in blocks of 2 s", hidden(0.2, 2.0), "", 1.1),
    Mistake("gripper1 hidden for a third", gone("gripper", 0, 0.33), "", 1.1),
    Mistake("base2 hidden for a third", gone("base", 1, 0.33), "", 1.1),
    Mistake("1 % of positions 50 mm off", ghosts(0.01, 0.05), "", 1.02),
    Mistake("3 % of positions 10 mm off", ghosts(0.03, 0.01), "", 1.02),
    Mistake("plate lost for a second", lost_plate(0.5, 1.0), "holes in the readings of the plate", 1.1),
)

VALIDATION = (
    Mistake("validation in millimetres", scaled(1000.0, "validation"), "in millimetres"),
    Mistake("validation 1 % too large", scaled(1.01, "validation"), "times as far apart as in dataset.json"),
    Mistake("validation in a mirror", scaled(-1.0, "validation"), "as in a mirror"),
    Mistake("validation 0.3 s late", late(0.3, -1.0, "validation"), "readings are late"),
    Mistake("validation 30 ms late", late(0.03, -1.0, "validation"), "readings are late"),
    Mistake("hand remounted before", moved("gripper", [0.01, 0.0, 0.0], -1.0, role="validation"), "are elsewhere"),
    Mistake("arm_4 gain before", gain(4, 0.03, "validation"), "arm_4_joint slipped"),
)


def at_random(rng: np.random.Generator, n: int) -> Iterator[Mistake]:
    """Mistakes at random, of every kind that calibration recordings alone can have."""

    def away(size: float) -> list[float]:
        d = rng.normal(size=3)
        return [float(x) for x in size * d / np.linalg.norm(d)]

    for _ in range(n):
        joint, share = int(rng.integers(1, 8)), float(rng.uniform(0.2, 0.8))
        body, marker = str(rng.choice(["base", "gripper"])), int(rng.integers(4))
        size, angle = float(10.0 ** rng.uniform(-2.5, -1.0)), float(10.0 ** rng.uniform(-2.5, -1.0))
        sign, at = float(rng.choice([-1.0, 1.0])), f"arm_{joint}"
        other = int(rng.choice([k for k in range(1, 8) if k != joint]))
        few = sorted({joint, *(int(k) for k in rng.integers(1, 8, rng.integers(0, 4)))})
        kinds = (
            Mistake(f"scale {1 + sign * angle / 2:.4f}", scaled(1.0 + sign * angle / 2), "x"),
            Mistake(f"{body}{marker + 1} drawn {1e3 * size:.1f} mm off", drawn_off(body, away(size), marker), "x"),
            Mistake(f"{body} drawn {1e3 * size:.1f} mm off", drawn_off(body, away(size)), "x"),
            Mistake(f"{body}{marker + 1} moves {1e3 * size:.1f} mm", moved(body, away(size), share, marker), "x"),
            Mistake(f"{body} slips {1e3 * size:.1f} mm", moved(body, away(size), share), "x"),
            Mistake(f"{at} gain {sign * angle:.4f}", gain(joint, sign * angle), "x"),
            Mistake(f"{at} slips {sign * angle:.4f} rad at {share:.2f}", slip(joint, sign * angle, share), "x"),
            Mistake(f"{at} drifts {sign * angle:.4f} rad", drift(joint, sign * angle), "x"),
            Mistake(f"late {1e3 * angle:.1f} ms at {share:.2f}", late(angle, share), "x"),
            Mistake(f"sides of {few} exchanged", exchanged_sides(few), "x"),
            Mistake(f"commands of {few}", commands(few), "x"),
            Mistake(f"dwells {10 * angle:.2f} s late", shifted_dwells(10.0 * sign * angle), "x"),
            Mistake(f"{at} lost {100 * size:.1f} s", lost_readings(joint, share, 100.0 * size), "x"),
            Mistake(f"columns {joint}, {other} exchanged", exchanged_columns(joint, other), "x"),
            Mistake(f"{body}{marker + 1} gone for {share:.2f}", gone(body, marker, min(share, 0.5)), "x"),
            Mistake(f"{100 * angle:.1f} % ghosts of {1e3 * size:.1f} mm", ghosts(angle, size, joint), "x"),
            Mistake(f"{100 * angle:.1f} % hidden", hidden(3.0 * angle, 20.0 * size, int(rng.integers(1000))), "x"),
        )
        yield kinds[int(rng.integers(len(kinds)))]
