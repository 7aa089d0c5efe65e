"""Recordings that cannot be what they say: wrong units, told before anything is fitted."""

from collections.abc import Iterator, Sequence

import numpy as np

from calibration.means import PostureMeans
from calibration.recording import Trial
from calibration.robot import Chain
from calibration.schema import Body, Description

_SCALE = 1.2  # believable ratio of measured to nominal distances between markers of a body, or its inverse [-]
_BEYOND = 0.3  # a reading may be outside its joint's limits by this much [rad, m] plus this share of the range
_SHARE = 0.05  # of the samples that may be farther out


def implausible_inputs(description: Description, chain: Chain, trials: Sequence[Trial | PostureMeans]) -> Iterator[str]:
    """Why the recordings of these trials cannot be used, each finding once."""
    for body in description.bodies:
        ratio = _scale(body, trials)
        if np.isfinite(ratio) and not 1.0 / _SCALE < ratio < _SCALE:
            unit = " (recorded in millimetres?)" if 500.0 < ratio < 2000.0 else ""
            yield f"markers of body {body.name!r} are {ratio:.3g} times as far apart as dataset.json says{unit}"
    yield from implausible_readings(chain, np.concatenate([trial.q_motor for trial in trials]))


def implausible_readings(chain: Chain, q: np.ndarray) -> Iterator[str]:
    """Joints whose readings q (n, n_measured) are far outside their limits."""
    if not len(q):
        return
    for name, column, low, high in zip(chain.measured, q.T, *chain.limits(), strict=True):
        margin = _BEYOND * (1.0 + (high - low))
        outside = float(((column < low - margin) | (column > high + margin)).mean())
        if outside > _SHARE:
            within = np.degrees(low) - 60.0 < column.min() and column.max() < np.degrees(high) + 60.0
            in_degrees = within and np.abs(column).max() > 2.0 * np.pi
            unit = " (recorded in degrees?)" if in_degrees and not chain.is_prismatic(name) else ""
            yield (
                f"joint {name!r} reads {column.min():.3g} to {column.max():.3g}, its limits are {low:.3g} to "
                f"{high:.3g}{unit}"
            )


def _scale(body: Body, trials: Sequence[Trial | PostureMeans]) -> float:
    """Median over pairs and samples of measured over nominal distance between markers [-]; NaN without a pair."""
    ratios = []
    for trial in trials:
        markers = [m for m in body.markers if m.name in trial.marker]
        p = trial.marker_position[
            :: max(1, len(trial.marker_position) // 50), [trial.marker.index(m.name) for m in markers]
        ]
        for i, a in enumerate(markers):
            for j in range(i):
                nominal = float(np.linalg.norm(np.subtract(a.xyz, markers[j].xyz)))
                ratios.append(np.linalg.norm(p[:, i] - p[:, j], axis=1) / nominal)
    found = np.concatenate([r[np.isfinite(r)] for r in ratios]) if ratios else np.zeros(0)
    return float(np.median(found)) if len(found) else float("nan")
