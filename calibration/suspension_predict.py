"""Where the base's markers are in a trial, predicted: its first second and a wrench, nothing else.

T_lab_B(t) = T_lab_0 exp(x(t)) T_0_B,     x from the plate's wrench or from inverse dynamics along q_motor
"""

import numpy as np

from calibration.recording import Trial
from calibration.suspension import Source, Suspension
from calibration.suspension_read import Laboratory
from calibration.suspension_rest import rest_of
from calibration.suspension_sway import forcing_of


def base_poses(suspension: Suspension, lab: Laboratory, trial: Trial, source: Source) -> np.ndarray:
    """T_lab_B (n, 4, 4) of the base's marker body at `t_mocap`; outside the wrench's recording it stays.

    Raises:
        NotEnoughData: The wrench, or the base's markers of the first second, were not recorded.
    """
    rest = rest_of(lab.description, trial, lab.T_base_B)
    load = lab.plate_load(trial, rest.T_lab_0) if source == "plate" else lab.dynamics_load(trial, rest.T_lab_0)
    forcing = forcing_of(load, float(trial.t_mocap[0]))
    x = suspension.displaced(forcing, source)
    return rest.poses(np.stack([np.interp(trial.t_mocap, forcing.t, column) for column in x.T], axis=1))
