"""What makes recordings implausible: units, marker bodies, joint columns, force plates."""

from calibration.checks.joint_readings import wrong_links
from calibration.checks.recordings import judged

__all__ = ["judged", "wrong_links"]
