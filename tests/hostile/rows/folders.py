"""Cases of places to write: a user's files, links, folders of others, what a killed command left."""

import shutil
from collections.abc import Callable
from pathlib import Path

from tests.hostile.rows.case import Case

_CSV, _LOOK = "export csv one --out out", "look one --out out"
_STALE = ".tiago-twin.0123456789abcdef.partial"


def _file(path: str, text: str = "mine") -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text)

    return spoil


def _link(path: str, to: str) -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).symlink_to(folder / to)

    return spoil


def _run_as_out(*more: Callable[[Path], None]) -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        (folder / "run").rename(folder / "out")
        for one in more:
            one(folder)

    return spoil


def _left_behind(folder: Path) -> None:
    shutil.copytree(folder / "run", folder / "out")
    _file(f"out/{_STALE}/new/evaluation.json", "{}")(folder)


PLACES = [
    Case("a folder with a user's file", _file("out/notes.txt"), _CSV, "notes.txt"),
    Case("a folder with a user's folder", _file("out/trials/notes.txt"), _CSV, "trials"),
    Case("a file", _file("out"), _CSV, "is a file"),
    Case("below a file", _file("out"), "export csv one --out out/below", "cannot be written"),
    Case("the folder one is in", lambda folder: None, "export csv one --out .", "you are in"),
    Case(
        "a name of 300 letters", lambda folder: None, "export csv one --out " + "a" * 300, "too long|cannot be written"
    ),
    Case("a name with NUL", lambda folder: None, "export csv one --out a\0b", "null"),
    Case(
        "a name that is not UTF-8", lambda folder: (folder / "caf\udce9").mkdir(), "look caf\udce9 --out out", "no such"
    ),
    Case("a link to a folder of the user's", _link("out", "csv"), "export csv run/dataset --out out", "left alone"),
    Case("a link to nothing", _link("out", "nowhere"), "calibrate nowhere --out out", "no such folder"),
    Case(
        "a user's score.json where an evaluation goes",
        _file("out/score.json"),
        "evaluate run/estimate run/dataset --out out",
        "score.json but no evaluation.json",
    ),
    Case(
        "a file where a URDF goes is a folder", _file("out/x"), "design short -n 13 --out out", "is a folder", slow=True
    ),
    Case("a run with results where recordings go", _run_as_out(), "simulate short --out out", "holds estimate"),
    Case(
        "figures that are a link",
        _run_as_out(lambda f: shutil.rmtree(f / "out/figures", ignore_errors=True), _link("out/figures", "csv")),
        "report out",
        "is a link",
    ),
    Case(
        "a prepared report.html.part",
        _run_as_out(_link("out/report.html.part", "scenario.yaml")),
        "report out",
        codes=(0,),
        slow=True,
    ),
    Case(
        "a report.html that is a link",
        _run_as_out(_link("out/report.html", "scenario.yaml")),
        "report out",
        codes=(0,),
        slow=True,
    ),
    Case("leftovers of a killed command", _left_behind, "check out --max model_2.mm=9", codes=(0, 1)),
]

GROUPS = {"places to write": PLACES}
