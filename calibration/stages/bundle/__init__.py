"""Stage bundle: geometry, physical drive trains, bending and the stick-slip base as one robot, row `full`."""

from calibration.stages.bundle.robot import BundledRobot, BundleParts
from calibration.stages.bundle.stage import BUNDLE, Bundle, fit_bundle

__all__ = ["BUNDLE", "Bundle", "BundleParts", "BundledRobot", "fit_bundle"]
