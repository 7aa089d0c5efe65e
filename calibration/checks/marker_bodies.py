"""Marker bodies that cannot be what dataset.json declares: wrong units, wrong columns, markers of another body.

Units show in distances between the markers of a body over their nominal ones; swapped or mislabelled columns in bodies
that are not rigid.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from calibration.recording.posture_means import PostureMeans
from calibration.recording.schema import Body, Description
from calibration.recording.trial import Trial

_FAR = 30.0  # [m] no marker of a laboratory is that far from its origin
_SAME = 1e-3  # [m] two markers are never closer
_SIZE = (0.02, 2.0)  # [m] believable largest distance within a body of markers
_FLEX = 0.01  # [m] a distance within a body may scatter by this much
_DRAWN = 0.03  # [m] a distance within a body may be off its drawing by this much
_SCALE = 1.2  # believable ratio of measured to nominal distances between markers of a body, or its inverse [-]


def implausible_markers(trial: Trial | PostureMeans, description: Description) -> Iterator[str]:
    """Markers of one trial that are never seen, too far, at one place, or of a body of impossible size."""
    p = trial.marker_position
    for k, name in enumerate(trial.marker):
        if len(p) and not np.isfinite(p[:, k]).all(axis=1).any():
            yield f"marker {name} is never seen; take it out of the mapping file"
    if np.isfinite(p).any() and (far := float(np.nanmax(np.abs(p)))) > _FAR:
        yield f"markers are up to {far:.0f} m from the laboratory's origin; in millimetres? see marker_unit"
    for body in description.bodies:
        for a, b, d in _pairs(body, trial):
            if np.isfinite(d).any() and np.nanmedian(d) < _SAME:
                what = "the same columns are mapped twice, or copied; or see marker_unit"
                yield f"markers {b} and {a} are at the same place; {what}"
        size = _size(body, trial)
        if np.isfinite(size) and not _SIZE[0] < size < _SIZE[1]:
            yield f"markers of body {body.name} are {size:.2g} m apart; see marker_unit"


def not_rigid(trial: Trial | PostureMeans, description: Description) -> Iterator[str]:
    """Bodies whose markers move against each other, or are not at their nominal distances."""
    for body in description.bodies:
        scatter = [(_scatter(d), a, b) for a, b, d in _pairs(body, trial) if np.isfinite(d).any()]
        worst, a, b = max(scatter, default=(0.0, "", ""))
        if worst > _FLEX:
            yield (
                f"body {body.name} is not rigid: {b} and {a} move by {1e3 * worst:.0f} mm against each other; columns "
                "swapped, or markers mislabelled: correct the mapping file or leave those markers out"
            )
            return
        nominal_xyz = {m.name: np.array(m.xyz) for m in body.markers}
        for a, b, d in _pairs(body, trial):
            apart, nominal = float(np.nanmedian(d)), float(np.linalg.norm(nominal_xyz[a] - nominal_xyz[b]))
            if abs(apart - nominal) > _DRAWN:
                yield (
                    f"body {body.name}: {a} and {b} are {1e3 * apart:.0f} mm apart, nominal {1e3 * nominal:.0f} mm; "
                    "columns swapped, or another marker: correct the mapping file"
                )
                return


def wrong_scale(description: Description, trials: Sequence[Trial | PostureMeans]) -> Iterator[str]:
    """Bodies whose markers are farther apart, or nearer, than dataset.json declares by a common factor."""
    for body in description.bodies:
        ratio = _scale(body, trials)
        if np.isfinite(ratio) and not 1.0 / _SCALE < ratio < _SCALE:
            unit = " (recorded in millimetres?)" if 500.0 < ratio < 2000.0 else ""
            yield f"markers of body {body.name!r} are {ratio:.3g} times as far apart as in dataset.json{unit}"


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


def _pairs(body: Body, trial: Trial | PostureMeans) -> Iterator[tuple[str, str, np.ndarray]]:
    names = [m.name for m in body.markers if m.name in trial.marker]
    for i, a in enumerate(names):
        for b in names[:i]:
            d = trial.marker_position[:, trial.marker.index(a)] - trial.marker_position[:, trial.marker.index(b)]
            yield a, b, np.linalg.norm(d, axis=1)


def _size(body: Body, trial: Trial | PostureMeans) -> float:
    sizes = [float(np.nanmedian(d)) for *_, d in _pairs(body, trial) if np.isfinite(d).any()]
    return max(sizes, default=float("nan"))


def _scatter(d: np.ndarray) -> float:
    """Standard deviation of most of the distances d (n,); a few wrong postures are for the calibration to name."""
    return float(1.4826 * np.nanmedian(np.abs(d - np.nanmedian(d))))
