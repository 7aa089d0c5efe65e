"""The parts of estimate.json that are more than parameters: the suspension and the joint models, as they predict."""

from dataclasses import asdict
from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict

from calibration.options import Terms
from calibration.stages.joints.model import JointModel, Quality
from calibration.stages.joints.repetitions import Regime, RegimeQuality
from calibration.stages.suspension.cross_validation import HeldOut
from calibration.stages.suspension.model import Source, Suspension

Rows = tuple[tuple[float, ...], ...]


class Part(BaseModel):
    """Frozen; no NaN."""

    model_config = ConfigDict(frozen=True, allow_inf_nan=False, extra="ignore")


class JointEntry(Part):
    """See `joint_model.JointModel`; coefficients and their covariance stand among the parameters of model_3."""

    joint: str
    terms: Terms
    degree: int | None = None
    powers: tuple[tuple[int, int], ...]
    dropped: tuple[tuple[int, int], ...]
    rho: float
    A: tuple[float, ...]
    B: tuple[float, ...]
    domain: Rows
    zero: float
    quality: tuple[float, float, float, float]


class RegimeEntry(Part):
    """See `repetitions.RegimeQuality`."""

    joint: str
    regime: Regime
    degree: int | None
    n: int
    before: float
    after: float
    r2: float
    outside: float


class HeldOutEntry(Part):
    """Leave-one-trial-out sums of the suspension for one source of the wrench."""

    source: Source
    error: Rows
    motion: Rows
    noise: Rows
    count: tuple[float, ...]


class SuspensionEntry(Part):
    """See `suspension.Suspension`; its parameters are those of model_1."""

    form: Literal["printed", "compliance"]
    K: Rows
    C: Rows
    tangent: Rows
    gravity: Rows
    held_out: tuple[HeldOutEntry, ...]


def joint_entry(model: JointModel) -> JointEntry:
    """A joint model as it is in the file."""
    q = model.quality
    return JointEntry(
        joint=model.joint,
        terms=model.terms,
        degree=model.degree,
        powers=model.powers,
        dropped=model.dropped,
        rho=model.rho,
        A=tuple(map(float, model.A)),
        B=tuple(map(float, model.B)),
        domain=_rows(model.domain),
        zero=model.zero,
        quality=(q.rms, q.residual, q.r2, q.r2_out),
    )


def joint_model(entry: JointEntry) -> JointModel:
    """A joint model as it was in the file."""
    return JointModel(
        entry.joint,
        entry.terms,
        entry.degree,
        entry.powers,
        entry.dropped,
        entry.rho,
        np.array(entry.A),
        np.array(entry.B),
        np.array(entry.domain),
        entry.zero,
        quality=Quality(*entry.quality),
    )


def regime_entry(quality: RegimeQuality) -> RegimeEntry:
    """The fit quality of a joint model in one regime as it is in the file."""
    return RegimeEntry.model_validate(asdict(quality))


def regime_quality(entry: RegimeEntry) -> RegimeQuality:
    """The fit quality of a joint model in one regime as it was in the file."""
    return RegimeQuality(**dict(entry))


def suspension_entry(suspension: Suspension) -> SuspensionEntry:
    """A suspension as it is in the file."""
    return SuspensionEntry(
        form=suspension.form,
        K=_rows(suspension.K),
        C=_rows(suspension.C),
        tangent=_rows(suspension.tangent),
        gravity=_rows(suspension.gravity),
        held_out=tuple(
            HeldOutEntry(
                source=source,
                error=_rows(h.error),
                motion=_rows(h.motion),
                noise=_rows(h.noise),
                count=tuple(map(float, h.count)),
            )
            for source, h in suspension.held_out
        ),
    )


def suspension_of(entry: SuspensionEntry) -> Suspension:
    """A suspension as it was in the file, without the sigmas that its parameters have."""
    unknown = np.full((6, 6), np.nan)
    return Suspension(
        entry.form,
        np.array(entry.K),
        np.array(entry.C),
        unknown,
        unknown,
        np.array(entry.tangent),
        np.array(entry.gravity),
        tuple(
            (h.source, HeldOut(np.array(h.error), np.array(h.motion), np.array(h.noise), np.array(h.count)))
            for h in entry.held_out
        ),
        (),
        (),
    )


def _rows(matrix: np.ndarray) -> Rows:
    return tuple(tuple(map(float, row)) for row in np.asarray(matrix))
