"""How the base moved in calibration trials, as far as it loads links: before drive trains and links are known.

By the base that sticks and slips as motors and wrench move it, and slowly as its markers show it, which do not show how
it accelerates.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from calibration.errors import NotEnoughData
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.numerics.side_by_side import side_by_side
from calibration.numerics.signals import even, interpolate_columns, low_passed
from calibration.recording.trial import Trial
from calibration.stages.drive_trains.stage import AS_SEEN, Moved, MovedBase
from calibration.stages.stick_slip.fit import linear_where, rough_direction
from calibration.stages.stick_slip.model import StickSlip
from calibration.stages.stick_slip.poses import forced
from calibration.stages.stick_slip.stage import campaign_of
from calibration.stages.stick_slip.standing import Read
from calibration.stages.suspension.base_response import WrenchSources
from calibration.stages.suspension.model import Suspension

_SLOWLY = 3.5  # [Hz] below which markers show a base's motion better than a wrench does


class RoughBase(NamedTuple):
    """How the base moved in each trial that shows it, and parameters (17,) of its wheels, None where none are known."""

    moved: Moved
    logarithms: np.ndarray | None = None


def moved_as_predicted(sources: WrenchSources, trials: Sequence[Trial], suspension: Suspension) -> RoughBase:
    """By the plate, or by inverse dynamics where there is none; nothing of trials and robots that do not show it."""
    try:
        campaign = campaign_of(sources, trials, suspension, most=1)
    except NotEnoughData:
        return RoughBase(AS_SEEN)
    source, _, of_source = campaign.by_source[0]
    direction = linear_where(rough_direction(source, of_source), suspension)
    model = StickSlip(campaign.wheels, campaign.tilting, (direction,))

    def moved_in(read: Read) -> MovedBase | None:
        try:
            forcing, t = forced(model, read.wrenches, source, None), read.trial.t_mocap
            x = interpolate_columns(t, forcing.t, model.displacement(forcing)[0])
            off = read.rest.displacement(MeasuredTrial.of(sources.lab.description, read.trial).base.T) - x
            slow = low_passed(even(t, off), _SLOWLY)
            x = x + interpolate_columns(t, slow.t, slow.x)
            return MovedBase(read.rest.poses(x), source == "plate")
        except NotEnoughData:
            return None

    found = zip(campaign.read, side_by_side(moved_in, campaign.read), strict=True)
    moved = {read.trial.id: one for read, one in found if one is not None}
    return RoughBase(moved, direction.logarithms)
