"""The page of a head-to-head of joint corrections: medians over robots, worst in brackets, joint by joint."""

from collections.abc import Mapping, Sequence

import numpy as np

from scenarios.datasets.index import Row
from scenarios.studies.joint_run import MOTIONS

_WORDS = {"in_sample": "In sample", "new_motion": "New motion", "static": "Static"}
_HEAD = """# Results: corrections of the joints, head to head

Rms error of the link angle against the truth [mrad], after the zero of the calibration dwells; medians over robots, the
worst in brackets. In sample: moving calibration trials. New motion: validation swings. Static: validation dwells.

{origin}
"""


def page(found: Mapping[str, Sequence[Row]], origin: str) -> str:
    """Markdown of runs by scenario; `origin` is the sentence that says how they were made."""
    return _HEAD.format(origin=origin) + "".join(_of_scenario(name, rows) for name, rows in found.items())


def _of_scenario(name: str, rows: Sequence[Row]) -> str:
    runs = [{m.name: m.value for m in row.magnitudes} for row in rows if row.status == "ok"]
    text = f"\n## `{name}`, {len(runs)} of {len(rows)} robots\n"
    if not runs:
        return text
    keys = [tuple(key.removesuffix("_mrad").split(".")) for key in runs[0]]
    corrections, joints = (list(dict.fromkeys(key[k] for key in keys)) for k in (0, 2))
    for motion in (motion for motion in MOTIONS if any(key[1] == motion for key in keys)):
        text += f"\n| {_WORDS[motion]} | {' | '.join(j.removesuffix('_joint') for j in joints)} |\n"
        text += f"|---{'|---:' * len(joints)}|\n"
        for correction in corrections:
            cells = [_cell([run[f"{correction}.{motion}.{joint}_mrad"] for run in runs]) for joint in joints]
            text += f"| {correction.replace('_', ', ')} | {' | '.join(cells)} |\n"
    return text


def _cell(values: Sequence[float]) -> str:
    return f"{np.median(values):.2f} [{max(values):.2f}]"
