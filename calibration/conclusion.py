"""What a calibration comes to, in one of four words.

calibrated                                    and nothing is seen of what the model leaves out
calibrated, unmodelled effect seen in Y       Y of time, reversal, load, posture; see `mismatch`
not identifiable                              the postures vary, but do not separate the parameters
not excited                                   too few distinct postures to say anything
"""

from collections.abc import Iterator

import numpy as np

from calibration.estimate.estimate import Estimate
from calibration.stages.geometry.guards import DEFICIENT, TOO_FEW
from calibration.verdict import Verdict

STAGE = "conclusion"


def conclusion(estimate: Estimate) -> Iterator[Verdict]:
    """Of the row that is delivered; nothing where effects were not tested, or recordings are wrong."""
    if not estimate.calibrated:
        refused = [v.message for v in estimate.verdicts if v.verdict == "refused"]
        for word, why in (("not excited", TOO_FEW), ("not identifiable", DEFICIENT)):
            if any(why in message for message in refused):
                yield Verdict(STAGE, "refused", word)
                return
        return
    tests = next((m.tests for m in estimate.models if m.name == estimate.main), ())
    if not tests:
        return
    seen = ", ".join(f"{t.name} ({1e3 * t.size:.2g} mm)" for t in tests if t.seen)
    untested = ", ".join(t.name for t in tests if not np.isfinite(t.p))
    word = f"calibrated, unmodelled effect seen in {seen}" if seen else "calibrated"
    yield Verdict(STAGE, "ok", f"{word}; not excited: {untested}" if untested else word)
