"""From what files say to trials of a dataset, written whole or not at all by the caller.

Files that a format's command does not read, and what to do instead: by their suffix, before they are opened.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from pydantic import ValidationError

from calibration.checks.joint_columns import check_columns
from calibration.checks.motor_currents import check_currents
from calibration.checks.recordings import check
from calibration.errors import InputError, InputErrors, NoSuchElement
from calibration.formats.mapping.channels import Joints, Markers, Plates, Reader, Recorded
from calibration.formats.mapping.dwell_means import rests_of
from calibration.formats.mapping.mapping import MappedTrial, MappingFile
from calibration.formats.mapping.marker_bodies import in_order, placed_bodies, unmatched
from calibration.formats.mapping.rests import with_rests
from calibration.recording.dataset import Dataset
from calibration.recording.posture_means import PostureMeans, write_means
from calibration.recording.schema import Description, TrialEntry
from calibration.recording.trial import Trial, write_trial
from calibration.robot.chain import Chain, chain_of_frames
from calibration.untrusted import findings

_OURS = {".c3d": "c3d", ".csv": "csv", ".bag": "bag", ".mcap": "bag", ".db3": "bag"}
_C3D = "export C3D from the program that recorded it: it has the plates' places and units, which this table has not"
_INSTEAD = {
    ".tsv": f"a table of Qualisys; {_C3D} (File, Export, To C3D)",
    ".qtm": "a Qualisys project; export C3D (File, Export, To C3D)",
    ".x1d": "raw data of Vicon; export C3D from Nexus",
    ".x2d": "raw data of Vicon; export C3D from Nexus",
    ".trc": f"markers of OpenSim, y up; {_C3D}",
    ".mot": f"forces of OpenSim, y up, reaction about the centre of pressure; {_C3D}",
    ".sto": f"a table of OpenSim; {_C3D}",
    ".mat": "a file of MATLAB; export C3D, or CSV with one header line",
    ".xlsx": "a workbook; save each sheet as CSV with one header line",
    ".active": "a bag that was not closed; run `rosbag reindex` on it and drop `.active` from its name",
    ".zstd": "compressed outside its bag; give the bag's folder, with its metadata.yaml",
    ".zst": "compressed outside its bag; decompress it, or give the bag's folder",
    ".gz": "compressed; decompress it",
    ".zip": "compressed; decompress it",
}


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
    together = sorted({name for r in recorded.values() for name in r.together} | set(content.setup.mocap_clock))
    try:
        bodies = before.description.bodies if before else placed_bodies(mapping, chain, calibration)
        fields = content.setup.model_dump() | {"mocap_clock": together, "bodies": bodies, "trials": ()}
        description = Description.model_validate(fields)
    except ValidationError as error:
        raise mapping.error("setup, bodies", findings(error, "mapping")) from error
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
    _write(out, mapping.urdf, description, sorted(found, key=_begin))
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
    placed = [_placed(t, read[t.stem].with_currents_turned(turned)) for t in trials]
    rested = with_rests(mapping, placed)
    return {t.id: rests_of(mapping, t, r) for t, r in zip(trials, rested, strict=True)}


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


def _begin(pair: tuple[MappedTrial, Trial | PostureMeans]) -> float:
    """When a trial began on the markers' clock [s], by which a dataset lists its trials; those without a time first."""
    trial = pair[1]
    return float(trial.t_mocap[0]) if isinstance(trial, Trial) and len(trial.t_mocap) else -np.inf


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


def format_of(path: Path) -> str:
    """c3d, csv or bag, by suffix; a folder is a bag of ROS 2."""
    return _OURS.get(path.suffix.lower(), "bag")


def refuse_foreign(kind: str | None, files: Sequence[Path]) -> None:
    """Refuse files of another format than `kind`: c3d, csv or bag; of any other than these where it is None.

    Raises:
        InputError: It names each file, what it is by its suffix, and what to do.
    """
    found = []
    for path in files:
        suffix = path.suffix.lower()
        ours = kind if kind is None else _OURS.get(suffix, kind)
        if ours != kind and not path.is_dir():
            found.append(InputError(path, f"is no {kind} by its suffix; read it with `tiago-twin import {ours}`"))
        elif suffix in _INSTEAD:
            found.append(InputError(path, f"is {_INSTEAD[suffix]}"))
        elif kind is None and suffix not in _OURS and not path.is_dir():
            found.append(InputError(path, "is no C3D, CSV or bag by its suffix; name recordings only"))
    if found:
        raise InputErrors(found)


def check_order(mapping: MappingFile, trials: Sequence[Trial | PostureMeans]) -> None:
    """Refuse trials that overlap in time: files that each begin at zero do not say when they began.

    Raises:
        InputError: Two do.
    """
    continuous = [t for t in trials if isinstance(t, Trial)]
    for clock in ("mocap", "robot", "plate"):
        spans = [(t[0], t[-1], trial.id) for trial in continuous if len(t := getattr(trial, f"t_{clock}"))]
        for (_, stop, a), (start, _, b) in pairwise(sorted(spans)):
            if start <= stop:
                raise mapping.error(
                    "trials",
                    f"{a} and {b} overlap in time on the {clock} clock: their files do not contain when they began; "
                    "give each a `start` [s]",
                )
