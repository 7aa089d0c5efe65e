"""What may be chosen about a calibration; the defaults are those the figures are made with."""

from typing import Literal

from pydantic import ConfigDict
from pydantic.dataclasses import dataclass

Elements = Literal["diagonal", "full"]
Terms = Literal["printed", "tensor", "total"]


@dataclass(frozen=True, config=ConfigDict(extra="forbid"))
class Options:
    """Choices, recorded with the estimate.

    Attributes:
        terms: Which monomials the degree of a joint model means; see `joint_model`.
        suspension: Elements of each wheel's Kt, Ct, Ktheta, Ctheta in the printed form of the suspension; see
            `suspension_wheels`.
    """

    terms: Terms = "total"
    suspension: Elements = "diagonal"
