"""Stage `geometry`: row `model_2`, then row `full` beside it, from static postures."""

from calibration.stages.geometry.gear_deflection import calibrate_gears
from calibration.stages.geometry.stage import STAGE, calibrate_geometry
from calibration.stages.stage import Stage, StageInput, StageResult
from calibration.verdict import Verdict


def _run(data: StageInput) -> StageResult:
    """Both rows; no `full` where `model_2` is rejected, or where it alone is and joint models follow."""
    chain, description, postures = data.lab.chain, data.lab.description, data.static
    model, findings = calibrate_geometry(chain, description, postures)
    if any(v.verdict == "refused" for v in findings):
        return StageResult((model,), findings)
    full, more = calibrate_gears(chain, description, postures)
    wrong = [v.message for v in more if v.verdict == "refused"]
    if wrong and data.moving:
        return StageResult((model,), (*findings, Verdict(STAGE, "warning", f"no row `full`: {'; '.join(wrong)}")))
    return StageResult((model, full), (*findings, *(v for v in more if v not in findings)))


GEOMETRY = Stage(STAGE, _run)
