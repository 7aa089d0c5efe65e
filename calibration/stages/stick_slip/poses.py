"""Where the base's markers are in a trial, predicted: its first second and a wrench, nothing else.

T_lab_B(t) = T_lab_0 exp(x(t)) T_0_B,     covariance of x: diag V(t), in frame 0
"""

from dataclasses import dataclass

import numpy as np

from calibration.recording.trial import Trial
from calibration.stages.stick_slip.forcing import planar_forcing, wrenches_of
from calibration.stages.stick_slip.model import StickSlip
from calibration.stages.suspension.base_response import WrenchSources
from calibration.stages.suspension.model import Source
from calibration.stages.suspension.rest_frame import rest_of


@dataclass(frozen=True)
class BasePrediction:
    """The base's marker body at `t_mocap` of a trial; outside the wrench's recording it stays.

    Attributes:
        T_lab_B: (n, 4, 4).
        variance: (n, 6) of the displacement in frame 0 [m, rad].
        T_lab_0: (4, 4) frame 0.
    """

    T_lab_B: np.ndarray
    variance: np.ndarray
    T_lab_0: np.ndarray


def slipping_base_poses(model: StickSlip, sources: WrenchSources, trial: Trial, source: Source) -> BasePrediction:
    """The base in a trial.

    Raises:
        NotEnoughData: The wrench, or the base's markers of the first second, were not recorded.
        NoSuchElement: The model was not fitted from that source.
    """
    rest = rest_of(sources.lab.description, trial, sources.T_base_B)
    forcing = planar_forcing(wrenches_of(sources, trial, rest.T_lab_0), model.tilting, source)
    x, variance = (_at(trial.t_mocap, forcing.t, columns) for columns in model.displacement(forcing))
    return BasePrediction(rest.poses(x), variance, rest.T_lab_0)


def _at(t: np.ndarray, grid: np.ndarray, columns: np.ndarray) -> np.ndarray:
    return np.stack([np.interp(t, grid, c) for c in columns.T], axis=1)
