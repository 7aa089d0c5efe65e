"""Files that a format's command does not read, and what to do instead: by their suffix, before they are opened."""

from collections.abc import Sequence
from pathlib import Path

from calibration.errors import InputError, InputErrors

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


def refuse_foreign(kind: str, files: Sequence[Path]) -> None:
    """Refuse files of another format than `kind`: c3d, csv or bag.

    Raises:
        InputError: It names each file, what it is by its suffix, and what to do.
    """
    found = []
    for path in files:
        suffix = path.suffix.lower()
        ours = _OURS.get(suffix, kind)
        if ours != kind and not path.is_dir():
            found.append(InputError(path, f"is no {kind} by its suffix; read it with `tiago-twin import {ours}`"))
        elif suffix in _INSTEAD:
            found.append(InputError(path, f"is {_INSTEAD[suffix]}"))
    if found:
        raise InputErrors(found)
