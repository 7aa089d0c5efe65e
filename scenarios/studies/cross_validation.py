"""How well static postures predict others of the same day that no stage has seen: a table of them divided.

    import csv, calibrate, evaluate        as of two days: the rows kept, the rows left out

Nothing knows the rows left out, not even where undrawn markers are on their body. One day alone says nothing of
another one: see `predicted_points.Session`.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from calibration.errors import NotCalibrated, NotEnoughData
from calibration.estimate import Estimate
from calibration.evaluation import PointRow, point_rows
from calibration.formats import Mapping
from calibration.mocap import Postures, mean_postures
from calibration.pipeline import calibrate
from calibration.recording import Dataset, load
from calibration.robot import chain_of
from calibration.stages.geometry import as_left_out, calibrate_gears, calibrate_geometry
from calibration.verdict import Verdict
from scenarios.files import yaml_file
from scenarios.files.errors import ScenarioError
from scenarios.steps.import_export import import_files

_OTHER = ("other_day_band_95_mm", "other_day_inside")


@dataclass(frozen=True)
class HeldOut:
    """Errors at postures that were not calibrated with.

    Attributes:
        points: Of `registration`, `model_2` and `full`, single markers and `all`.
        verdicts: Findings, postures left out among them.
    """

    points: tuple[PointRow, ...]
    verdicts: tuple[Verdict, ...]


def held_out(files: Sequence[Path], mapping: Path) -> HeldOut:
    """Calibrate the postures of some CSV files and predict those of others; the mapping says which are which.

    Raises:
        ScenarioError, InputError: The files are not what the mapping says.
        NotCalibrated: An estimate must not be used.
    """
    with TemporaryDirectory() as folder:
        import_files("csv", files, mapping, Path(folder) / "dataset")
        dataset = load(Path(folder) / "dataset")
        found = _estimate(dataset)
        recorded = tuple(dataset.means("validation"))
        return HeldOut(point_rows(found, dataset.description, recorded), found.verdicts)


def cross_validated(table: Path, mapping: Path, parts: Iterable[np.ndarray]) -> tuple[HeldOut, ...]:
    """Each part (row numbers from 0, the head not counted) of a CSV table left out in turn.

    Args:
        table: Static postures, one a row.
        mapping: Of two such files, for calibration and validation, as docs/mappings/qualisys_two_days.yaml.
        parts: What is left out.

    Raises:
        ScenarioError: There is no such table, or the mapping is not of two files. Otherwise as `held_out`.
    """
    names = {trial.role: trial.stem for trial in yaml_file.read(mapping, Mapping).trials}
    if set(names) != {"calibration", "validation"}:
        raise ScenarioError(f"{mapping}: trials have roles {sorted(names)}; one calibration and one validation needed")
    if not table.is_file():
        raise ScenarioError(f"{table}: no such file; name a CSV table with a head and one static posture a row")
    head, *lines = table.read_text(encoding="utf-8").splitlines()
    found = []
    with TemporaryDirectory() as folder:
        for part in parts:
            rows = {"calibration": np.delete(np.arange(len(lines)), part), "validation": part}
            files = {Path(folder) / f"{name}.csv": rows[role] for role, name in names.items()}
            for file, mine in files.items():
                file.write_text("\n".join([head, *(lines[k] for k in mine)]) + "\n", encoding="utf-8")
            found.append(held_out(tuple(files), mapping))
    return tuple(found)


def at_random(n: int, parts: int, rng: np.random.Generator) -> list[np.ndarray]:
    """Row numbers of n postures in equal parts."""
    return np.array_split(rng.permutation(n), parts)


def by_regions(q: np.ndarray, parts: int, rng: np.random.Generator) -> list[np.ndarray]:
    """Row numbers of postures q (n, k) in equal slices along a random direction of the joints' space."""
    spread = q.std(axis=0)
    along = (q - q.mean(axis=0)) / np.where(spread > 0.0, spread, 1.0) @ rng.normal(size=q.shape[1])
    return np.array_split(np.argsort(along), parts)


def pooled(found: Iterable[HeldOut], model: str, marker: str) -> PointRow:
    """All postures left out together; bands are the median of the parts'.

    Raises:
        NotEnoughData: No part has that row and marker.
    """
    rows = [p for part in found for p in part.points if (p.model, p.marker) == (model, marker)]
    if not rows:
        raise NotEnoughData(f"nothing was left out of row {model!r}, marker {marker!r}")
    n, rms, far, *bands = (
        np.array([getattr(p, name) for p in rows])
        for name in ("n", "rmse_norm_mm", "max_norm_mm", "band_95_mm", "inside", *_OTHER)
    )
    total = int(n.sum())
    rmse = float(np.sqrt((n * rms**2).sum() / total))
    shares = [float((n * x).sum() / total) for x in bands[1::2]]
    radii = [float(np.median(x)) for x in bands[::2]]
    return PointRow("left out", model, marker, total, rmse, float(far.max()), radii[0], shares[0], radii[1], shares[1])


def _estimate(dataset: Dataset) -> Estimate:
    """The estimate of `calibrate` without what to record next, which takes seconds."""
    chain, description = chain_of(dataset.urdf, dataset.description), dataset.description
    known = calibrate(dataset, ("registration",))
    postures = reduce(Postures.joined, (mean_postures(description, m) for _, m in dataset.means("calibration")))
    found = [stage(chain, description, postures) for stage in (calibrate_geometry, calibrate_gears)]
    verdicts = (*known.verdicts, *(v for _, findings in found for v in findings))
    if refused := [v.message for v in verdicts if v.verdict == "refused"]:
        raise NotCalibrated(refused)
    models = (found[0][0], as_left_out(chain, description, postures, found[1][0]))
    return replace(known, models=(*known.models, *models), verdicts=verdicts)
