"""The mapping file that reads exported files back: what a dataset knows and its files do not say.

A dataset as laboratory files, one set a trial, and the mapping that reads them back.
"""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from calibration.errors import InputError
from calibration.formats.bag.messages import ABSOLUTE, COMMAND, MOTOR, WRIST
from calibration.formats.bag.write import write_bag
from calibration.formats.c3d.write import DWELL_EVENTS, write_c3d
from calibration.formats.csv.write import FIELDS, plate_columns, wrist_columns, write_csv, write_means_csv
from calibration.formats.mapping.layouts import BagLayout, C3dLayout, C3dPlateMap, CsvTable, CsvTime, JointChannels
from calibration.formats.mapping.mapping import MappedBody, MappedTrial, Mapping
from calibration.recording.dataset import Dataset
from calibration.recording.posture_means import PostureMeans
from calibration.recording.schema import Description, Setup, TrialEntry
from calibration.recording.trial import Trial
from calibration.robot.chain import Chain, chain_of

_T = CsvTime(column="t", unit="s")


def mapping_of(
    description: Description, chain: Chain, trials: Sequence[tuple[TrialEntry, Trial | PostureMeans]]
) -> Mapping:
    """The mapping of exported trials; it reads them from any of the formats, the robot beside it in `nominal.urdf`."""
    setup = Setup.model_validate({name: getattr(description, name) for name in Setup.model_fields})
    names = [m.name for b in description.bodies for m in b.markers]
    standing = {name for _, trial in trials if isinstance(trial, Trial) for name in trial.plate}
    numbers = {p.name: k + 1 for k, p in enumerate(description.plates) if p.name in standing}
    plates = {name: C3dPlateMap(number=k, convention="reaction") for name, k in numbers.items()}
    wrist = any(isinstance(trial, Trial) and np.isfinite(trial.wrist_wrench).any() for _, trial in trials)
    linked, commanded = (
        any(isinstance(trial, Trial) and np.isfinite(getattr(trial, side)).any() for _, trial in trials)
        for side in ("q_link", "q_command")
    )
    static = any(isinstance(trial, Trial) and len(trial.dwell_start) for _, trial in trials)
    return Mapping(
        urdf="nominal.urdf",
        setup=setup,
        bodies=tuple(map(MappedBody.of, description.bodies)),
        trials=tuple(_trial(entry, trial) for entry, trial in trials),
        csv=_tables(description, chain, trials, wrist),
        c3d=C3dLayout(
            markers={n: n for n in names}, plates=plates, dwell_events=DWELL_EVENTS if static else None
        ),
        bag=BagLayout(
            source="joint_states", motor=MOTOR,
            link=ABSOLUTE if linked else None, command=COMMAND if commanded else None,
            joints={j: j for j in description.joint_names},
            wrist=WRIST if wrist else None, wrist_convention="action" if wrist else None,
        ),
    )  # fmt: skip


def _trial(entry: TrialEntry, trial: Trial | PostureMeans) -> MappedTrial:
    dwells = None
    if isinstance(trial, Trial) and len(trial.dwell_start):
        dwells = tuple((float(a), float(b)) for a, b in zip(trial.dwell_start, trial.dwell_stop, strict=True))
    approach = tuple(tuple(int(x) for x in row) for row in trial.approach) if trial.approach.any() else None
    known = {"id": entry.id, "role": entry.role, "kind": entry.kind, "motion": entry.motion, "payload": entry.payload}
    return MappedTrial.model_validate(known | {"dwells": dwells, "approach": approach})


def _tables(
    description: Description,
    chain: Chain,
    trials: Sequence[tuple[TrialEntry, Trial | PostureMeans]],
    wrist: bool,
) -> tuple[CsvTable, ...]:
    names = [m.name for b in description.bodies for m in b.markers]
    markers = {n: (f"{n}_x", f"{n}_y", f"{n}_z") for n in names}
    units = {j: "m" if chain.is_prismatic(j) else "rad" for j in description.joint_names}
    tables = []
    stds = [float(t.marker_position_std.max()) for _, t in trials if isinstance(t, PostureMeans)]
    if stds:
        joints = {j: JointChannels.model_validate({"motor": j, "unit": u}) for j, u in units.items()}
        tables.append(CsvTable(suffix=".postures.csv", marker_std=max(stds), markers=markers, joints=joints))
    channels = {j: {f: f"{j}_{f}" for f in FIELDS} | {"unit": u} for j, u in units.items()}
    tables += [
        CsvTable(suffix=".mocap.csv", time=_T, markers=markers),
        CsvTable(
            suffix=".robot.csv",
            time=_T,
            joints={j: JointChannels.model_validate(c) for j, c in channels.items()},
            wrist=wrist_columns() if wrist else None,
        ),
    ]
    if any(isinstance(trial, Trial) and len(trial.dwell_start) for _, trial in trials):
        tables.append(CsvTable(suffix=".dwells.csv", dwells=("start", "stop")))
    if description.plates:
        plates = {p.name: plate_columns(p.name) for p in description.plates}
        tables.append(CsvTable(suffix=".plate.csv", time=_T, plates=plates))
    return tuple(tables)


def export_trials(
    kind: str, dataset: Dataset, folder: Path, ros: int = 1, progress: Callable[[str, float], None] | None = None
) -> tuple[Mapping, tuple[str, ...]]:
    """Write all trials of a dataset into a folder; return the mapping and the trials the format has nothing of.

    Args:
        kind: `c3d` (markers and plates), `csv` (everything) or `bag` (joint readings).
        dataset: What to write.
        folder: Where to.
        ros: Version of ROS of a bag, 1 or 2.
        progress: Called with each trial and the share written before it.

    Raises:
        InputError: The format cannot hold a trial, or no trial has anything for it.
    """
    written, notes = [], []
    for k, entry in enumerate(dataset.description.trials):
        if progress is not None:
            progress(entry.id, k / len(dataset.description.trials))
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
