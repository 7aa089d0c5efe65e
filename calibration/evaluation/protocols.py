"""One estimate under two protocols: as the paper's public evaluation code scored its models, and as we score ours.

public     one run of 5 s; the base measured from model_1 on, link encoders in model_3, the mean error of models 2 and 3
           removed along each axis of the lab; RMSE per component, orientation by components of the rotation vector
ours       every held-out dynamic trial whole; the base from the plate (else inverse dynamics, else still), motor
           encoders, nothing removed; the same two figures

The difference between the two columns is what oracles and removed constants are worth: it explains the field's numbers.
Source: facts read in the public evaluation code of Nguyen et al. 2024, which may differ from what made the figures.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from calibration.estimate.rows import LADDER
from calibration.evaluation.ladder import Row, TrialErrors
from calibration.evaluation.pose_errors import PoseErrors

_WINDOW = 5.0  # [s]
_PAPER = tuple((row, row.published) for row in LADDER if row.published is not None)


@dataclass(frozen=True)
class ProtocolRow:
    """A model under a protocol.

    Attributes:
        protocol: `public` or `ours`.
        model: Row of the ladder.
        base: Where the base's motion came from.
        encoder: Which side of the gear was read.
        constants_removed: Whether the mean error was taken off, per axis.
        n: Poses.
        position_rmse_component_mm: [mm].
        orientation_rmse_component_deg: [deg].
    """

    protocol: Literal["public", "ours"]
    model: str
    base: str
    encoder: str
    constants_removed: bool
    n: int
    position_rmse_component_mm: float
    orientation_rmse_component_deg: float


def protocol_rows(traces: Sequence[TrialErrors], rows: Sequence[Row]) -> tuple[ProtocolRow, ...]:
    """The paper's models under both protocols, as far as they are there."""
    return (*_public(traces), *_ours(rows))


def _public(traces: Sequence[TrialErrors]) -> Iterator[ProtocolRow]:
    for row, p in _PAPER:
        key = (row.name, p.base, p.encoder)
        mine = (t for t in traces if (t.model, t.base, t.encoder) == key and t.kind != "static")
        trace = next(mine, None)
        if trace is None:
            continue
        middle = 0.5 * (trace.t[0] + trace.t[-1])
        inside = np.abs(trace.t - middle) <= 0.5 * _WINDOW
        e = PoseErrors(trace.errors.position[inside], trace.errors.rotation[inside]).complete
        if len(e):
            x, phi = e.position, e.rotation
            if p.constants_removed:
                x, phi = x - x.mean(axis=0), phi - phi.mean(axis=0)
            mm, deg = 1e3 * float(np.sqrt((x**2).mean())), float(np.degrees(np.sqrt((phi**2).mean())))
            yield ProtocolRow("public", *key, p.constants_removed, len(e), mm, deg)


def _ours(rows: Sequence[Row]) -> Iterator[ProtocolRow]:
    for row, _ in _PAPER:
        mine = {r.base: r for r in rows if (r.model, r.trials, r.encoder) == (row.name, "dynamic", "motor")}
        base = row.predictive_base(mine.keys())
        if base is not None:
            m = mine[base].metrics
            yield ProtocolRow(
                "ours",
                row.name,
                base,
                "motor",
                False,
                m.n,
                m.position_rmse_component_mm,
                m.orientation_rmse_component_deg,
            )
