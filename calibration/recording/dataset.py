"""A dataset folder: dataset.json, nominal.urdf and the trials, each read on demand."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from calibration.errors import InputError, NoSuchElement
from calibration.recording.posture_means import PostureMeans, holds_means, read_means
from calibration.recording.schema import Description, Role, TrialEntry
from calibration.recording.trial import Trial, read_trial, sha256
from calibration.untrusted import check_file, checked_urdf, findings, read_json, read_text

_MOST_BYTES = 2**30  # [B] of a trial's file


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
        self._check_names(entry, trial)
        return trial

    def read_means(self, entry: TrialEntry) -> PostureMeans:
        """Read one trial that holds posture means, and check it against dataset.json.

        Raises:
            InputError: As `read`.
        """
        means = read_means(self._unchanged(entry), entry.id)
        self._check_names(entry, means)
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
        check_file(path, _MOST_BYTES)
        if not path.resolve().is_relative_to(self.folder.resolve()):
            raise InputError(path, f"is a link out of the dataset, to {path.resolve()}; copy the file into it")
        if sha256(path) != entry.sha256:
            raise InputError(path, "its sha256 is not the one in dataset.json: truncated or changed; copy it again")
        return path

    def _check_names(self, entry: TrialEntry, trial: Trial | PostureMeans) -> None:
        path, about = self.folder / entry.file, self.description
        if trial.joint != about.joint_names:
            raise InputError(path, f"joints {trial.joint}, dataset.json has {about.joint_names}")
        owners = {m.name: b.name for b in about.bodies for m in b.markers}
        stray = [m for m, b in zip(trial.marker, trial.marker_body, strict=True) if owners.get(m) != b]
        if stray:
            raise InputError(path, f"markers {stray[:5]} are on no body of dataset.json, or on another one")
        plates = [p for p in getattr(trial, "plate", ()) if p not in {known.name for known in about.plates}]
        if plates:
            raise InputError(path, f"plates {plates[:5]} are not in dataset.json")


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


def _read_description(path: Path) -> Description:
    try:
        return Description.model_validate(read_json(path, "a dataset needs it"))
    except ValidationError as error:
        raise InputError(path, findings(error, "dataset")) from error


def _read_urdf(path: Path, description: Description) -> str:
    import pinocchio as pin  # so that the format alone, as the twin writes it, needs no Pinocchio

    text = checked_urdf(read_text(path, hint="a dataset needs it"), path)
    try:
        model = pin.buildModelFromXML(text)
    except (ValueError, RuntimeError) as error:
        raise InputError(path, f"not a URDF Pinocchio can build ({error})") from error
    joints, frames = list(model.names), [f.name for f in model.frames]
    for kind, names, known in (
        ("joint", description.joint_names, joints),
        ("frame", (description.base_frame, description.tool_frame, *(b.link for b in description.bodies)), frames),
        ("frame", () if description.wrist_link is None else (description.wrist_link,), frames),
        ("frame", () if description.payload is None else (description.payload.link,), frames),
    ):
        for name in names:
            if name not in known:
                raise InputError(path, str(NoSuchElement(kind, name, known)))
    return text
