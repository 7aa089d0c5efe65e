"""A dataset as laboratory files, one set a trial, and the mapping that reads them back."""

from pathlib import Path

from calibration.dataset import Dataset
from calibration.errors import InputError
from calibration.io.bag_write import write_bag
from calibration.io.c3d_write import write_c3d
from calibration.io.csv_write import write_csv, write_means_csv
from calibration.io.mapping import Mapping
from calibration.io.mapping_of import mapping_of
from calibration.means import PostureMeans
from calibration.recording import Trial
from calibration.robot import chain_of


def export_trials(kind: str, dataset: Dataset, folder: Path, ros: int = 1) -> tuple[Mapping, tuple[str, ...]]:
    """Write all trials of a dataset into a folder; return the mapping and the trials the format has nothing of.

    Args:
        kind: `c3d` (markers and plates), `csv` (everything) or `bag` (joint readings).
        dataset: What to write.
        folder: Where to.
        ros: Version of ROS of a bag, 1 or 2.

    Raises:
        InputError: The format cannot hold a trial, or no trial has anything for it.
    """
    written, notes = [], []
    for entry in dataset.description.trials:
        trial = dataset.read_means(entry) if dataset.has_means(entry) else dataset.read(entry)
        why = _write(kind, dataset, folder, trial, ros)
        if why:
            notes.append(f"{entry.id}: not written: {why}")
        else:
            written.append((entry, trial))
    if not written:
        raise InputError(dataset.folder, f"no trial has anything for {kind}: {notes[0] if notes else 'no trials'}")
    (folder / "nominal.urdf").write_text(dataset.urdf, encoding="utf-8")
    chain = chain_of(dataset.urdf, dataset.description)
    return mapping_of(dataset.description, chain, written), tuple(notes)


def _write(kind: str, dataset: Dataset, folder: Path, trial: Trial | PostureMeans, ros: int) -> str:
    """Write one trial; say why not where the format has nothing of it."""
    if isinstance(trial, PostureMeans):
        if kind == "csv":
            write_means_csv(folder, trial)
        return "" if kind == "csv" else "posture means have no time; export csv"
    if kind == "csv":
        write_csv(folder, trial)
    elif kind == "c3d":
        if not len(trial.t_mocap):
            return "no markers"
        write_c3d(folder / f"{trial.id}.c3d", trial, dataset.description)
    else:
        if not len(trial.t_robot):
            return "no joint readings"
        write_bag(folder / (f"{trial.id}.bag" if ros == 1 else trial.id), trial, 1 if ros == 1 else 2)
    return ""
