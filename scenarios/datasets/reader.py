"""Read a collection lazily: nothing is opened before it is asked for."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from calibration.untrusted import read_json
from scenarios.datasets.index import Row, read_index
from scenarios.datasets.run_spec import run_name
from scenarios.files.errors import ScenarioError

if TYPE_CHECKING:
    import xarray

    from calibration import Dataset
    from calibration.recording import Trial
    from twin.truth import TruthTrial


@dataclass(frozen=True)
class Run:
    """One run of a collection.

    Attributes:
        row: Its line in the index.
        folder: Where it is.
    """

    row: Row
    folder: Path

    @property
    def dataset(self) -> "Dataset":
        """Its recordings."""
        import calibration

        return calibration.load(self.folder / "dataset")

    def trial(self, name: str) -> "Trial":
        """One trial as numpy arrays."""
        from calibration.recording import read_trial

        return read_trial(self._file("dataset", name), name)

    def truth(self, name: str) -> "TruthTrial":
        """What was true in one trial, as numpy arrays."""
        from twin.truth import read_trial

        return read_trial(self._file("truth", name))

    def xarray(self, name: str, part: str = "dataset") -> "xarray.Dataset":
        """One trial of `dataset` or `truth`, lazily; xarray must be installed."""
        import xarray

        return xarray.open_dataset(self._file(part, name), engine="netcdf4", decode_times=False)

    def _file(self, part: str, name: str) -> Path:
        path = self.folder / part / "trials" / f"{name}.nc"
        if not path.is_file():
            there = sorted(p.stem for p in path.parent.glob("*.nc"))
            raise ScenarioError(f"{path}: no such trial; the trials are {', '.join(there) or '(none)'}")
        return path


@dataclass(frozen=True)
class Collection:
    """A collection.

    Attributes:
        folder: Where it is.
        rows: Its index.
    """

    folder: Path
    rows: tuple[Row, ...]

    def runs(self, split: str | None = None) -> Iterator[Run]:
        """Complete runs, of one split (train, validation, test) or all."""
        good = (row for row in self.rows if row.status == "ok" and split in (None, row.split))
        return (Run(row, self.folder / "runs" / run_name(row.id)) for row in good)


def open_collection(folder: Path | str) -> Collection:
    """Open a collection folder.

    Raises:
        ScenarioError: It is none, or its index is missing: the command that makes it has not ended.
    """
    folder = Path(folder)
    for name in ("collection.json", "index.csv"):
        if not (folder / name).is_file():
            raise ScenarioError(f"{folder / name}: no such file; run the same `dataset` command again")
    read_json(folder / "collection.json")
    return Collection(folder, read_index(folder / "index.csv"))
