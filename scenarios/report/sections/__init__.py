"""The sections of the report, in their order on the page; the first one is what a reader sees without scrolling."""

from scenarios.report.results.section import Section
from scenarios.report.sections.base_motion import BaseMotion
from scenarios.report.sections.errors import HeldOutErrors
from scenarios.report.sections.frames import Frames
from scenarios.report.sections.joints import Joints
from scenarios.report.sections.ladder import Ladder
from scenarios.report.sections.paper_models import PaperModels
from scenarios.report.sections.parameters import Parameters
from scenarios.report.sections.payload import Payload
from scenarios.report.sections.recordings import Recordings
from scenarios.report.sections.residuals import Absorbed, Residuals
from scenarios.report.sections.slip import Slip
from scenarios.report.sections.stages import Reproduce, Stages
from scenarios.report.sections.verdict import Fitted, Verdict

SECTIONS: tuple[type[Section], ...] = (
    Verdict,
    Ladder,
    HeldOutErrors,
    PaperModels,
    Frames,
    BaseMotion,
    Slip,
    Joints,
    Payload,
    Parameters,
    Residuals,
    Absorbed,
    Recordings,
    Stages,
    Reproduce,
)
UNEVALUATED: tuple[type[Section], ...] = (Fitted, Parameters, Absorbed, Recordings, Stages)
"""Those of a fit without held-out trials."""
