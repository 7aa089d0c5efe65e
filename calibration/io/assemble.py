"""From what files say to trials of a dataset, written whole or not at all by the caller."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from calibration.dataset import Dataset
from calibration.errors import InputError, InputErrors, NoSuchElement
from calibration.io.bodies import in_order, placed_bodies, unmatched
from calibration.io.check import check, check_order
from calibration.io.effort_check import check_currents
from calibration.io.hand_check import check_columns
from calibration.io.mapping import MappedTrial, MappingFile
from calibration.io.recorded import Joints, Markers, Plates, Recorded
from calibration.io.rests import rests_of
from calibration.means import PostureMeans, write_means
from calibration.recording import Trial, write_trial
from calibration.robot import Chain, chain_of_frames
from calibration.schema import Description, TrialEntry

Read = Callable[[Sequence[Path]], Recorded]
Stem = Callable[[Path], str]


@dataclass(frozen=True)
class Reader:
    """A format: how to read the files of one trial, and what of a file's name is the trial's."""

    read: Read
    stem: Stem


def import_files(
    files: Sequence[Path], reader: Reader, mapping: MappingFile, out: Path, before: Dataset | None = None
) -> tuple[str, ...]:
    """Write a dataset from laboratory files into the folder `out`, and say what was recognised.

    Args:
        files: All files; each belongs to the trial of its name.
        reader: Of their format.
        mapping: What the files do not say.
        out: An empty folder.
        before: A dataset imported before from other instruments; its trials gain these files' channels.

    Raises:
        InputError: Something does not fit together; every finding of every file.
    """
    chain, content = _chain(mapping), mapping.content
    recorded = _read_all(files, reader, mapping)
    calibration = [recorded[t.id] for t in content.trials if t.role == "calibration"]
    bodies = before.description.bodies if before else placed_bodies(mapping, chain, calibration)
    together = sorted({name for r in recorded.values() for name in r.together} | set(content.setup.mocap_clock))
    fields = content.setup.model_dump() | {"mocap_clock": together, "bodies": bodies, "trials": ()}
    description = Description.model_validate(fields)
    mass = float(pin.computeTotalMass(pin.buildModelFromXML(mapping.urdf, pin.JointModelFreeFlyer())))
    found, problems = [], []
    for entry in content.trials:
        try:
            trial = _trial(entry, recorded[entry.id], description, before)
            check(recorded[entry.id].file, trial, description, chain, mass)
            found.append((entry, trial))
        except InputError as error:
            problems.append(error)
    if problems:
        raise InputErrors(problems)
    check_order(mapping, [trial for _, trial in found])
    for session in (("calibration", "validation"), ("confirmation",)):
        some = [(recorded[entry.id].file, trial) for entry, trial in found if entry.role in session]
        check_columns(description, chain, some)
        check_currents(chain, some)
    _write(out, mapping.urdf, description, found)
    return tuple(dict.fromkeys(note for r in recorded.values() for note in r.notes))


def _chain(mapping: MappingFile) -> Chain:
    s = mapping.content.setup
    try:
        chain = chain_of_frames(mapping.urdf, s.joint_names, s.base_frame, s.tool_frame)
        if s.wrist_link is not None:
            chain.poses(np.zeros((1, len(s.joint_names))), s.wrist_link)
        return chain
    except NoSuchElement as error:
        raise mapping.error("setup", str(error)) from error


def _read_all(files: Sequence[Path], reader: Reader, mapping: MappingFile) -> dict[str, Recorded]:
    """Every trial's channels on their clocks."""
    by_stem: dict[str, list[Path]] = {}
    trials = mapping.content.trials
    for path in files:
        by_stem.setdefault(reader.stem(path), []).append(path)
    known = {t.stem for t in trials}
    problems = [
        InputError(paths[0], f"no trial of the mapping has the file {stem!r}; its trials have {sorted(known)}")
        for stem, paths in by_stem.items()
        if stem not in known
    ]
    problems += [
        mapping.error(f"trials.{t.id}", f"no file {t.stem!r} was given") for t in trials if t.stem not in by_stem
    ]
    read: dict[str, Recorded] = {}
    for stem in (s for s in by_stem if s in known):
        try:
            read[stem] = reader.read(by_stem[stem])
        except InputError as error:
            problems.append(error)
    if problems:
        raise InputErrors(problems)
    turned = mapping.content.reversed_effort
    placed = {t.id: _placed(t, read[t.stem].with_currents_turned(turned)) for t in trials}
    return {t.id: rests_of(mapping, t, placed[t.id]) for t in trials}


def _placed(trial: MappedTrial, recorded: Recorded) -> Recorded:
    """The part of the file that is the trial, at its time."""
    if trial.part is not None:
        recorded = recorded.part(*trial.part)
    short = [name for name, t in recorded.timed() if len(t) < 2]
    if short:
        raise InputError(recorded.file, f"trial {trial.id}: fewer than two samples of {short}; see `part` of the trial")
    return recorded if trial.start is None else recorded.shifted(trial.start)


def _trial(
    entry: MappedTrial, recorded: Recorded, description: Description, before: Dataset | None
) -> Trial | PostureMeans:
    owner = {m.name: b.name for b in description.bodies for m in b.markers}
    if recorded.means is not None:
        return _means(entry, recorded, description, owner)
    trial = _empty(entry.id, description) if before is None else before.read(_entry_before(before, entry.id))
    fields: dict[str, Any] = {}
    if recorded.joints is not None:
        fields |= _joint_fields(recorded, recorded.joints, description.joint_names)
    if recorded.markers is not None:
        fields |= _marker_fields(recorded, recorded.markers, owner)
    if recorded.plates is not None:
        fields |= _plate_fields(recorded.plates)
    dwells = recorded.dwells if entry.dwells is None else np.array(entry.dwells).reshape(-1, 2)
    if dwells is not None:
        approach = np.zeros((len(dwells), len(description.joints))) if entry.approach is None else entry.approach
        fields |= {
            "dwell_start": dwells[:, 0],
            "dwell_stop": dwells[:, 1],
            "approach": np.array(approach, dtype=np.int8),
        }
    return replace(trial, **fields)


def _entry_before(before: Dataset, trial_id: str) -> TrialEntry:
    found = next((t for t in before.description.trials if t.id == trial_id), None)
    if found is None:
        raise InputError(before.folder, f"has no trial {trial_id!r} to add these channels to")
    return found


def _empty(trial_id: str, description: Description) -> Trial:
    none = np.zeros((0, len(description.joints)))
    return Trial(
        trial_id, description.joint_names, np.zeros(0), none, none, none, none, none,
        (), (), np.zeros(0), np.zeros((0, 0, 3)),
    )  # fmt: skip


def _joint_fields(recorded: Recorded, joints: Joints, names: Sequence[str]) -> dict[str, Any]:
    missing, unknown = unmatched(joints.names, names)
    if missing or unknown:
        raise InputError(
            recorded.file, f"joints: {missing} of the setup are not mapped, {unknown} are not in the setup"
        )
    order = [joints.names.index(name) for name in names]
    wrist = np.zeros((0, 6)) if joints.wrist_wrench is None else joints.wrist_wrench
    return {"t_robot": joints.t, "wrist_wrench": wrist} | {
        field: getattr(joints, field)[:, order] for field in ("q_motor", "q_link", "v_motor", "effort", "q_command")
    }


def _marker_fields(recorded: Recorded, markers: Markers, owner: Mapping[str, str]) -> dict[str, Any]:
    stray = [name for name in markers.names if name not in owner]
    if stray:
        raise InputError(recorded.file, f"markers {stray} belong to no body; add them to one, or do not map them")
    bodies = tuple(owner[name] for name in markers.names)
    return {"marker": markers.names, "marker_body": bodies, "t_mocap": markers.t, "marker_position": markers.position}


def _plate_fields(plates: Plates) -> dict[str, Any]:
    return {"plate": plates.names, "t_plate": plates.t, "plate_wrench": plates.wrench, "plate_centre": plates.centre}


def _means(entry: MappedTrial, recorded: Recorded, description: Description, owner: Mapping[str, str]) -> PostureMeans:
    means = recorded.means
    if means is None or entry.kind != "static":
        raise InputError(recorded.file, f"holds static postures, trial {entry.id} is declared as {entry.kind}")
    fields = _marker_fields(recorded, Markers(np.zeros(0), means.markers, means.position), owner)
    q = in_order(recorded, description.joint_names)
    approach = np.zeros(q.shape) if entry.approach is None else np.array(entry.approach)
    return PostureMeans(
        entry.id, description.joint_names, q, fields["marker"], fields["marker_body"], means.position,
        np.full(means.position.shape, means.std), approach,
    )  # fmt: skip


def _write(
    out: Path, urdf: str, description: Description, trials: Sequence[tuple[MappedTrial, Trial | PostureMeans]]
) -> None:
    (out / "trials").mkdir()
    entries = []
    for entry, trial in trials:
        file = f"trials/{entry.id}.nc"
        digest = write_means(out / file, trial) if isinstance(trial, PostureMeans) else write_trial(out / file, trial)
        entries.append(
            TrialEntry(
                id=entry.id,
                role=entry.role,
                kind=entry.kind,
                motion=entry.motion or entry.id,
                file=file,
                sha256=digest,
                payload=entry.payload,
            )  # fmt: skip
        )
    text = description.model_copy(update={"trials": tuple(entries)}).model_dump_json(indent=1)
    (out / "dataset.json").write_text(text + "\n", encoding="utf-8")
    (out / "nominal.urdf").write_text(urdf, encoding="utf-8")
