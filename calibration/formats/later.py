"""The mapping of a session recorded later, for an estimate that is there already.

Marker bodies are those the estimate was found with: none is placed by the new recordings. Trials are for validation;
files the mapping has no trial of are trials of their own names, what moves in them as they show it.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from calibration.formats.mapping.mapping import MappedBody, MappedTrial, MappingFile
from calibration.formats.readers import reader_of
from calibration.formats.survey.bodies import FoundBody
from calibration.formats.survey.trials import kind_of
from calibration.recording.schema import Description


def of_later_session(mapping: MappingFile, files: Sequence[Path], laboratory: Description) -> MappingFile:
    """The mapping that reads `files`, with the marker bodies of an estimate's laboratory.

    Raises:
        InputError: It is another robot's, or a file cannot be read.
    """
    setup = mapping.content.setup
    for name in ("base_frame", "tool_frame", "joint_names"):
        ours, theirs = getattr(laboratory, name), getattr(setup, name)
        if ours != theirs:
            raise mapping.error(f"setup.{name}", f"{theirs}; the estimate is of {ours}")
    bodies = tuple(map(MappedBody.of, laboratory.bodies))
    reader, by_stem = reader_of(None, mapping), dict[str, list[Path]]()
    for path in files:
        by_stem.setdefault(reader.stem(path), []).append(path)
    known = {t.stem: t for t in mapping.content.trials}
    shown = [FoundBody(b.name, b.marker_names, 0.0) for b in bodies if b.markers]
    trials = tuple(
        known[stem].model_copy(update={"role": "validation"})
        if stem in known
        else MappedTrial.model_validate({"id": stem, "role": "validation", "kind": kind_of(reader.read(paths), shown)})
        for stem, paths in by_stem.items()
    )
    return replace(mapping, content=mapping.content.model_copy(update={"bodies": bodies, "trials": trials}))
