"""Files of other formats are reported by name, with the export or the command that is read."""

import pytest

from tests.calibration.formats.test_csv import static_mapping

SAID = [
    ("csv", "log.tsv", ["a table of Qualisys", "To C3D"]),
    ("csv", "log.TRC", ["y up", "export C3D"]),
    ("csv", "log.mot", ["reaction about the centre of pressure", "export C3D"]),
    ("c3d", "log.mat", ["MATLAB"]),
    ("csv", "log.c3d", ["is no csv by its suffix", "`tiago-twin import c3d`"]),
    ("c3d", "log.csv", ["`tiago-twin import csv`"]),
    ("csv", "log.mcap", ["`tiago-twin import bag`"]),
    ("bag", "log.bag.active", ["rosbag reindex"]),
    ("bag", "log.db3.zst", ["decompress it, or give the bag's folder"]),
]


@pytest.mark.parametrize(("kind", "name", "words"), SAID, ids=[f"{k} {n}" for k, n, _ in SAID])
def test_a_file_of_another_format_is_reported_with_what_to_do(lab, capsys, kind, name, words):
    (lab.folder / name).write_text("x\n1\n")
    said = lab.refused(capsys, static_mapping(), lab.folder / name, kind=kind)
    for word in (f"{name}: ", *words):
        assert word in said


def test_all_foreign_files_are_reported_at_once(lab, capsys):
    paths = [lab.folder / n for n in ("a.tsv", "b.trc")]
    for path in paths:
        path.write_text("x\n")
    said = lab.refused(capsys, static_mapping(), *paths)
    assert "a.tsv" in said and "b.trc" in said
