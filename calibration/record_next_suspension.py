"""How many more swings would tell elements of a suspension that the recorded ones leave open; and which none would.

An element's standard deviation is the jackknife's over n trials. With m more trials like them it is

    after = before sqrt(n / (n + m))

and the element is told when that is below its share of the diagonal pair (`suspension_parameters`). On an axis whose
motion springs do not explain, because wheels slip there, no number of trials tells a spring. Nor does one total wrench
tell the wheels apart: that takes a plate under each.
"""

import numpy as np

from calibration.remedy import Motion, Remedy, Sigma
from calibration.suspension import AXES, Suspension
from calibration.suspension_parameters import KNOWN
from calibration.verdict import Verdict

STAGE = "suspension"
_MOST = 3  # times as many trials as were recorded: more is nobody's campaign [-]
_SECONDS, _HERTZ = 25.0, 0.2  # of a swing


def swings_next(suspension: Suspension) -> tuple[Remedy | None, tuple[Verdict, ...]]:
    """Swings for the elements that scatter between trials; None where there is none, or too many would be needed."""
    held_out = suspension.held_out[0][1]
    n, slips = len(held_out.error), held_out.slips
    open_ = {p.name: p for p in suspension.parameters if p.status == "not_identifiable"}
    needed, slipping = {}, []
    for letter, matrix in (("K", suspension.K), ("C", suspension.C)):
        root = np.sqrt(np.abs(np.diag(matrix)))
        for i, j in zip(*np.triu_indices(6), strict=True):
            name = f"suspension.{letter}.{i + 1}{j + 1}"
            if name in open_ and (slips[i] or slips[j]):
                slipping.append(name)
            elif name in open_:
                ratio = open_[name].sigma / (KNOWN * root[i] * root[j])
                needed[name] = int(np.ceil(n * max(0.0, ratio**2 - 1.0))) + 1
    said = []
    if slipping:
        axes = ", ".join(name for name, slip in zip(AXES, slips, strict=True) if slip)
        message = (
            f"{len(slipping)} elements of K and C: no motion tells a spring along {axes}, which slip or hardly move"
        )
        said.append(Verdict(STAGE, "warning", message))
    wheels = [name for name in open_ if name not in needed and name not in slipping]
    if wheels:
        message = f"{', '.join(wheels)}: no motion tells wheels apart by their total wrench; a plate under each would"
        said.append(Verdict(STAGE, "warning", message))
    within = {name: m for name, m in needed.items() if m <= _MOST * n}
    if not within:
        return None, tuple(said)
    m = max(within.values())
    share = float(np.sqrt(n / (n + m)))
    sigma = tuple(Sigma(x, open_[x].unit, open_[x].sigma, share * open_[x].sigma) for x in within)
    why = f"not identifiable: {', '.join(within)}"
    said.append(
        Verdict(STAGE, "warning", f"{why}; {m} more swings like the {n} recorded would tell, in record_next.yaml")
    )
    motions = (Motion("swing", repeats=m, frequency=_HERTZ, seconds=_SECONDS),)
    return Remedy(STAGE, why, motions=motions, sigma=sigma), tuple(said)
