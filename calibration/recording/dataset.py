"""A dataset folder: dataset.json, nominal.urdf and the trials, each read on demand."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from calibration.errors import InputError, NoSuchElement
from calibration.recording.posture_means import PostureMeans, holds_means, read_means
from calibration.recording.schema import Description, Role, TrialEntry
from calibration.recording.trial import Trial, read_trial, sha256


@dataclass(frozen=True)
class Dataset:
    """A dataset folder that has been read and found consistent; trials are read on demand.

    Attributes:
        folder: Where it is.
        description: The whole of dataset.json.
        urdf: Text of nominal.urdf.
    """

    folder: Path
    description: Description
    urdf: str

    def entries(self, role: Role, *kinds: str) -> tuple[TrialEntry, ...]:
        """Trials of a role, of the given kinds (all kinds where none is named), in file order."""
        return tuple(t for t in self.description.trials if t.role == role and (not kinds or t.kind in kinds))

    def read(self, entry: TrialEntry) -> Trial:
        """Read one continuous trial as it was recorded and check it against dataset.json.

        Raises:
            InputError: The file is damaged, changed since it was listed, names other joints, or holds means only.
        """
        trial = read_trial(self._unchanged(entry), entry.id)
        self._check_joints(entry, trial.joint)
        return trial

    def read_means(self, entry: TrialEntry) -> PostureMeans:
        """Read one trial that holds posture means, and check it against dataset.json.

        Raises:
            InputError: As `read`.
        """
        means = read_means(self._unchanged(entry), entry.id)
        self._check_joints(entry, means.joint)
        return means

    def has_means(self, entry: TrialEntry) -> bool:
        """Whether a trial's file holds posture means instead of a continuous recording."""
        return entry.kind == "static" and holds_means(self.folder / entry.file)

    def trials(self, role: Role, *kinds: str) -> Iterator[tuple[TrialEntry, Trial]]:
        """Read the continuous trials of a role one after the other."""
        for entry in self.entries(role, *kinds):
            if not self.has_means(entry):
                yield entry, self.read(entry)

    def means(self, role: Role) -> Iterator[tuple[TrialEntry, PostureMeans]]:
        """Read the trials of a role that hold posture means one after the other."""
        for entry in self.entries(role, "static"):
            if self.has_means(entry):
                yield entry, self.read_means(entry)

    def _unchanged(self, entry: TrialEntry) -> Path:
        path = self.folder / entry.file
        if path.is_file() and sha256(path) != entry.sha256:
            raise InputError(path, "its sha256 is not the one in dataset.json: truncated or changed; copy it again")
        return path

    def _check_joints(self, entry: TrialEntry, joints: tuple[str, ...]) -> None:
        if joints != self.description.joint_names:
            path = self.folder / entry.file
            raise InputError(path, f"joints {joints}, dataset.json has {self.description.joint_names}")


def load(folder: Path | str) -> Dataset:
    """Open a dataset folder.

    Raises:
        InputError: Something is missing or malformed; all findings of dataset.json at once.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(folder, "no such folder; a dataset is a folder with dataset.json, nominal.urdf and trials/")
    description = _read_description(folder / "dataset.json")
    missing = [t.file for t in description.trials if not (folder / t.file).is_file()]
    if missing:
        raise InputError(folder, f"files listed in dataset.json are missing: {missing}")
    return Dataset(folder, description, _read_urdf(folder / "nominal.urdf", description))


def _read_text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise InputError(path, "no such file; a dataset needs it") from error
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(path, f"cannot be read ({error})") from error


def _read_description(path: Path) -> Description:
    text = _read_text(path)
    try:
        return Description.model_validate(json.loads(text))
    except json.JSONDecodeError as error:
        raise InputError(f"{path}:{error.lineno}:{error.colno}", f"broken JSON: {error.msg}") from error
    except ValidationError as error:
        lines = [f"{'.'.join(map(str, e['loc'])) or 'dataset'}: {e['msg']}" for e in error.errors()]
        raise InputError(path, "; ".join(lines)) from error


def _read_urdf(path: Path, description: Description) -> str:
    import pinocchio as pin  # so that the format alone, as the twin writes it, needs no Pinocchio

    text = _read_text(path)
    try:
        model = pin.buildModelFromXML(text)
    except (ValueError, RuntimeError) as error:
        raise InputError(path, f"not a URDF Pinocchio can build ({error})") from error
    joints, frames = list(model.names), [f.name for f in model.frames]
    for kind, names, known in (
        ("joint", description.joint_names, joints),
        ("frame", (description.base_frame, description.tool_frame, *(b.link for b in description.bodies)), frames),
        ("frame", () if description.wrist_link is None else (description.wrist_link,), frames),
    ):
        for name in names:
            if name not in known:
                raise InputError(path, str(NoSuchElement(kind, name, known)))
    return text
