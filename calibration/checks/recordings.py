"""What cannot be true of an imported trial, told by file and channel before anything is written.

Units show in sizes: a body of markers against its drawing, a reading against its joint's limits, the plate's load
against the robot's weight. Swapped or mislabelled columns show in bodies that are not rigid; those of joints, see
`hand_check`.

Recordings that cannot be what they say: wrong units, told before anything is fitted.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from calibration.errors import InputError
from calibration.recording.posture_means import PostureMeans
from calibration.recording.schema import Body, Description
from calibration.recording.trial import Trial
from calibration.robot.chain import Chain

_FAR = 30.0  # [m] no marker of a laboratory is that far from its origin
_SAME = 1e-3  # [m] two markers are never closer
_SIZE = (0.02, 2.0)  # [m] believable largest distance within a body of markers
_FLEX = 0.01  # [m] a distance within a body may scatter by this much
_DRAWN = 0.03  # [m] a distance within a body may be off its drawing by this much
_APART, _FEW = 0.1, 20  # [rad, m] a link may be off its motor by this much, its zero apart; readings to judge by
_LOAD = 3.0  # believable ratio of the plates' load to the robot's weight, or its inverse
_SCALE = 1.2  # believable ratio of measured to nominal distances between markers of a body, or its inverse [-]
_BEYOND = 0.3  # a reading may be outside its joint's limits by this much [rad, m] plus this share of the range
_SHARE = 0.05  # of the samples that may be farther out


def check(file: str, trial: Trial | PostureMeans, description: Description, chain: Chain, mass: float) -> None:
    """Refuse what cannot be true.

    Args:
        file: Where the trial came from, for the message.
        trial: What is to be written.
        description: Of the dataset it is to be written in.
        chain: The nominal chain.
        mass: Of the nominal robot [kg].

    Raises:
        InputError: With everything that was found.
    """
    found = [*_markers(trial, description), *_readings(trial)]
    found += [] if found else [*implausible_inputs(description, chain, (trial,))]
    found += [] if found else [*_rigid(trial, description)]
    if isinstance(trial, Trial):
        found += [*_sides(trial), *_clocks(trial), *_load(trial, mass * float(np.linalg.norm(description.gravity)))]
    if found:
        raise InputError(file, "; ".join(found))


def _markers(trial: Trial | PostureMeans, description: Description) -> Iterator[str]:
    p = trial.marker_position
    for k, name in enumerate(trial.marker):
        if len(p) and not np.isfinite(p[:, k]).all(axis=1).any():
            yield f"marker {name} is never seen; take it out of the mapping file"
    if np.isfinite(p).any() and (far := float(np.nanmax(np.abs(p)))) > _FAR:
        yield f"markers are up to {far:.0f} m from the laboratory's origin; in millimetres? see marker_unit"
    for body in description.bodies:
        for a, b, d in _pairs(body, trial):
            if np.isfinite(d).any() and np.nanmedian(d) < _SAME:
                yield f"markers {b} and {a} are at the same place; the same columns are mapped twice, or copied"
        size = _size(body, trial)
        if np.isfinite(size) and not _SIZE[0] < size < _SIZE[1]:
            yield f"markers of body {body.name} are {size:.2g} m apart; see marker_unit"


def _readings(trial: Trial | PostureMeans) -> Iterator[str]:
    for k, name in enumerate(trial.joint):
        bad = np.flatnonzero(~np.isfinite(trial.q_motor[:, k]))
        if len(bad):
            yield f"joint {name}: {len(bad)} readings are missing, the first in sample {bad[0]}; cut them out"
    if isinstance(trial, Trial):
        bad = np.flatnonzero(~np.isfinite(trial.plate_wrench).all(axis=(1, 2)))
        if len(bad):
            yield f"plate: {len(bad)} samples are missing, the first is {bad[0]}; cut them out, or leave the plate out"


def _sides(trial: Trial) -> Iterator[str]:
    """Link readings that do not follow their motor's; zeros of either side may be anything."""
    for k, name in enumerate(trial.joint):
        known = np.isfinite(trial.q_link[:, k])
        if known.sum() < _FEW or _range(trial.q_link[known, k] - trial.q_motor[known, k]) < _APART:
            continue
        others = {
            (other, said): _range(trial.q_link[known, k] - sign * trial.q_motor[known, j])
            for j, other in enumerate(trial.joint)
            for sign, said in ((1.0, "follows"), (-1.0, "runs against"))
            if _range(trial.q_motor[known, j]) > 2.0 * _APART
        }
        other, said = min(others, key=lambda key: others[key], default=("", ""))
        hint = f"; it {said} the motor of {other}" if others and others[other, said] < _APART else ""
        yield f"joint {name}: its link reading does not follow its motor's{hint}: columns swapped, or a sign reversed"


def _range(x: np.ndarray) -> float:
    """Between the 5th and the 95th percentile."""
    low, high = np.percentile(x, (5.0, 95.0))
    return float(high - low)


def _clocks(trial: Trial) -> Iterator[str]:
    for name in ("t_robot", "t_mocap", "t_plate"):
        t = getattr(trial, name)
        back = np.flatnonzero(~(np.diff(t) > 0.0))
        if len(back):
            k = int(back[0])
            yield f"{name} does not increase at sample {k + 1} ({t[k]:.6f} s, then {t[k + 1]:.6f} s); sort it"


def _load(trial: Trial, weight: float) -> Iterator[str]:
    if not len(trial.t_plate):
        return
    load = -float(np.median(trial.plate_wrench[:, :, 2].sum(axis=1)))
    if load < 0.0:
        yield (
            f"plate: Fz is {-load:+.0f} N on a robot that weighs {weight:.0f} N: its wrench is the reaction, or the "
            "plate is upside down; see convention and axes"
        )
    elif not weight / _LOAD < load < weight * _LOAD:
        yield f"plate carries {load:.3g} N, the nominal robot weighs {weight:.0f} N; see the plate's units and labels"


def _pairs(body: Body, trial: Trial | PostureMeans) -> Iterator[tuple[str, str, np.ndarray]]:
    names = [m.name for m in body.markers if m.name in trial.marker]
    for i, a in enumerate(names):
        for b in names[:i]:
            d = trial.marker_position[:, trial.marker.index(a)] - trial.marker_position[:, trial.marker.index(b)]
            yield a, b, np.linalg.norm(d, axis=1)


def _size(body: Body, trial: Trial | PostureMeans) -> float:
    sizes = [float(np.nanmedian(d)) for *_, d in _pairs(body, trial) if np.isfinite(d).any()]
    return max(sizes, default=float("nan"))


def _rigid(trial: Trial | PostureMeans, description: Description) -> Iterator[str]:
    for body in description.bodies:
        scatter = [(_scatter(d), a, b) for a, b, d in _pairs(body, trial) if np.isfinite(d).any()]
        worst, a, b = max(scatter, default=(0.0, "", ""))
        if worst > _FLEX:
            yield (
                f"body {body.name} is not rigid: {b} and {a} move by {1e3 * worst:.0f} mm against each other; columns "
                "swapped, or markers mislabelled: correct the mapping file or leave those markers out"
            )
            return
        drawn = {m.name: np.array(m.xyz) for m in body.markers}
        for a, b, d in _pairs(body, trial):
            apart, nominal = float(np.nanmedian(d)), float(np.linalg.norm(drawn[a] - drawn[b]))
            if abs(apart - nominal) > _DRAWN:
                yield (
                    f"body {body.name}: {a} and {b} are {1e3 * apart:.0f} mm apart, drawn {1e3 * nominal:.0f} mm; "
                    "columns swapped, or another marker: correct the mapping file"
                )
                return


def _scatter(d: np.ndarray) -> float:
    """Standard deviation of most of the distances d (n,); a few wrong postures are for the calibration to name."""
    return float(1.4826 * np.nanmedian(np.abs(d - np.nanmedian(d))))


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
