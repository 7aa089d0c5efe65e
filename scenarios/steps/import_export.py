"""Laboratory files into a dataset folder, and out of one: the commands `import` and `export`."""

import os
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calibration.untrusted import checked_urdf, read_text
from scenarios.files import output_folder, yaml_file
from scenarios.files.errors import ScenarioError
from scenarios.steps import drawing_file
from scenarios.steps.run_steps import Progress, silent

if TYPE_CHECKING:
    from calibration.formats import Mapping
    from calibration.recording import Description

PACKAGED = "tiago"
"""What a mapping calls the nominal robot that comes with this program."""

MAPPING = "mapping.yaml"
"""The mapping file beside exported files."""

_READING = 0.8  # share of the time of an import that reading takes; checking the rest


def import_files(
    kind: str | None,
    files: Sequence[Path],
    mapping: Path,
    out: Path,
    add_to: Path | None = None,
    later: "Description | None" = None,
    progress: Progress = silent,
) -> tuple[str, ...]:
    """Write the dataset folder `out` from laboratory files; return what was recognised in them.

    Args:
        kind: `c3d`, `csv` or `bag`; None: each by its suffix.
        files: The files, those the mapping names where there are none; each belongs to the trial of its name.
        mapping: The mapping file.
        out: The dataset folder; an earlier dataset there is replaced.
        add_to: A dataset imported before whose trials gain these files' channels.
        later: Laboratory of an estimate whose later session this is: its marker bodies, trials for validation.
        progress: Called with which file is read.

    Raises:
        ScenarioError: The mapping is malformed, or `out` must not be overwritten.
        InputError: A file is not what the mapping says; every finding of every file.
    """
    from calibration.formats import MappingFile, of_later_session, reader_of, refuse_foreign
    from calibration.formats import import_files as write
    from calibration.recording import load

    described = read_mapping(mapping)
    files = [p for p in files if p.suffix.lower() != ".csv" or not drawing_file.is_drawing(p)]
    files = files or files_of(described.files, mapping)
    refuse_foreign(kind, files)
    source = MappingFile(mapping, described, _urdf(described, mapping))
    source = source if later is None else of_later_session(source, files, later)
    before = None if add_to is None else load(add_to)
    reader = reader_of(kind, source)
    n, stems = len({reader.stem(path) for path in files}), count()

    def read(paths: Sequence[Path]) -> Any:
        progress("import", paths[0].name, _READING * next(stems) / n)
        return reader.read(paths)

    with output_folder.replacing(out, output_folder.DATASET) as new:
        return write(files, replace(reader, read=read), source, new, before)


def read_mapping(path: Path) -> "Mapping":
    """The mapping of a file, its short forms written out.

    Raises:
        ScenarioError: It is malformed; all findings.
    """
    from calibration.formats import Mapping, written_out

    def prepared(values: dict[str, Any]) -> dict[str, Any]:
        values = dict(values)
        if isinstance(values.get("bodies"), str):
            values["bodies"] = drawing_file.bodies(path.parent / values["bodies"])
        setup = values.get("setup")
        if isinstance(setup, dict) and setup.get("wheels") == PACKAGED:
            values["setup"] = setup | {"wheels": _wheels()}
        try:
            return written_out(values)
        except (AttributeError, IndexError, KeyError, TypeError, ValueError):
            return values  # not even the short form's; the validation says what is wrong

    return yaml_file.read(path, Mapping, prepare=prepared)


def files_of(patterns: Sequence[str], mapping: Path) -> tuple[Path, ...]:
    """The files a mapping names, patterns beside it.

    Raises:
        ScenarioError: It names none, or a pattern fits none.
    """
    if not patterns:
        raise ScenarioError(f"{mapping}: files: none named there or on the command line")
    found: dict[Path, None] = {}
    for pattern in patterns:
        fitting = sorted(mapping.parent.glob(pattern)) if not Path(pattern).is_absolute() else [Path(pattern)]
        some = [p for p in fitting if p.suffix.lower() != ".csv" or not drawing_file.is_drawing(p)]
        if not some:
            raise ScenarioError(f"{mapping}: files: {pattern} fits no file in {mapping.parent.resolve().name}")
        found |= dict.fromkeys(some)
    return tuple(found)


def init_mapping(files: Sequence[Path], out: Path, urdf: Path | None = None) -> str:
    """Write a mapping file drafted from laboratory files; return its text.

    Args:
        files: All files of the session, of any formats; a table of marker bodies may be among them.
        out: The mapping file.
        urdf: The nominal robot; the one that comes with this program unless given.

    Raises:
        ScenarioError: `out` exists, or the URDF cannot be read.
        InputError: A file cannot be read; all findings.
    """
    from calibration.formats import Drawing, draft, refuse_foreign, session_of

    if out.exists():
        raise ScenarioError(
            f"{out}: exists; a mapping is written by hand from then on: name another file, or remove it"
        )
    drawn = [p for p in files if p.suffix.lower() == ".csv" and drawing_file.is_drawing(p)]
    if len(drawn) > 1:
        raise ScenarioError(f"{drawn[1]}: a second table of marker bodies; {drawn[0]} is one")
    recordings = [p for p in files if p not in drawn]
    refuse_foreign(None, recordings)
    drawing = None
    if drawn:
        drawing = Drawing(_beside(drawn[0], out), drawing_file.names(drawn[0]))
    name = PACKAGED if urdf is None else _beside(urdf, out)
    session = session_of(recordings, _robot(name, out), drawing)
    wheels = PACKAGED if urdf is None and any(view.plates for view in session.views) else None
    text = draft(session, name, _patterns(recordings, out), wheels)
    with output_folder.one_file(out) as new:
        new.write_text(text, encoding="utf-8")
    return text


def _beside(path: Path, mapping: Path) -> str:
    """A path as seen from the mapping's folder."""
    return Path(os.path.relpath(path.resolve(), mapping.resolve().parent)).as_posix()


def _patterns(files: Sequence[Path], mapping: Path) -> list[str]:
    """Paths beside the mapping; all of one suffix in a folder as one pattern."""
    found: dict[str, None] = {}
    given = {p.resolve() for p in files}
    for path in files:
        like = set(path.resolve().parent.glob(f"*{path.suffix}")) if path.suffix else set()
        like = {p for p in like if p.suffix.lower() != ".csv" or not drawing_file.is_drawing(p)}
        every = len(like) > 1 and like <= given
        found[_beside(path.parent / f"*{path.suffix}" if every else path, mapping)] = None
    return list(found)


def _wheels() -> list[dict[str, Any]]:
    import mjcf

    return [
        {"name": w.name, "type": w.type, "centre": list(w.centre), "contact": list(w.contact)} for w in mjcf.wheels()
    ]


def export_files(kind: str, dataset: Path, out: Path, ros: int = 1, progress: Progress = silent) -> tuple[str, ...]:
    """Write the trials of a dataset as files of one format into the folder `out`, with the mapping that reads them.

    Returns:
        Trials the format has nothing of, and why.

    Raises:
        ScenarioError: `out` must not be overwritten.
        InputError: The dataset cannot be read, or the format cannot hold it.
    """
    from calibration.formats import export_trials
    from calibration.recording import load

    source = load(dataset)
    with output_folder.replacing(out, _exported(kind, [t.id for t in source.description.trials])) as new:
        mapping, notes = export_trials(kind, source, new, ros, partial(progress, "export"))
        yaml_file.write(new / MAPPING, mapping)
        drawing_file.write(new / drawing_file.NAME, source.description.bodies)
    return notes


def export_urdf(estimate: Path, out: Path) -> None:
    """Write the calibrated URDF of an estimate as the file `out`.

    Raises:
        InputError: There is no estimate, or it must not be used.
    """
    from calibration.errors import NotCalibrated
    from calibration.estimate import CALIBRATED, load_estimate

    found = load_estimate(estimate)
    path = (estimate if estimate.is_dir() else estimate.parent) / CALIBRATED
    found.require_calibrated()
    if not path.is_file():
        why = [v.message for v in found.verdicts if v.stage == "geometry" and v.verdict == "missing"]
        raise NotCalibrated([f"{estimate}: no geometry in this estimate, so no calibrated URDF", *why])
    with output_folder.one_file(out) as new:
        new.write_text(path.read_text(encoding="utf-8"), encoding="utf-8")


def _exported(kind: str, trials: Sequence[str]) -> output_folder.Kind:
    """Folders of exported files that may be replaced: those of the same trials."""
    suffixes = {
        "csv": (".mocap.csv", ".robot.csv", ".plate.csv", ".dwells.csv", ".postures.csv"),
        "c3d": (".c3d",),
        "bag": (".bag", ""),
    }
    files = {f"{trial}{suffix}" for trial in trials for suffix in suffixes[kind]}
    return output_folder.Kind(
        f"{kind} export", MAPPING, frozenset(files | {MAPPING, "nominal.urdf", drawing_file.NAME})
    )


def _urdf(mapping: "Mapping", path: Path) -> str:
    return _robot(mapping.urdf, path)


def _robot(name: str, path: Path) -> str:
    if name == PACKAGED:
        import mjcf

        return mjcf.urdf()
    found = (path.parent / name).resolve()  # the mapping's folder need not be there yet
    return checked_urdf(read_text(found, hint=f"it is `urdf` of {path}; or write `urdf: {PACKAGED}`"), found)
