"""Static postures of a real robot, their mappings, and postures spoilt on purpose."""

from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
TABLE = ROOT / "tests/data/qualisys_2021-11-30_postures.csv"
TWO_DAYS = ROOT / "docs/mappings/qualisys_two_days.yaml"
KINDS = (0.02, 0.05, 0.3, "labels")


def real_rows() -> tuple[str, np.ndarray]:
    """Head and numbers of the table."""
    return TABLE.read_text().splitlines()[0], np.loadtxt(TABLE, delimiter=",", skiprows=1)


def written(path: Path, head: str, rows: np.ndarray) -> Path:
    path.parent.mkdir(exist_ok=True)
    np.savetxt(path, rows, delimiter=",", header=head, comments="", fmt="%.6f")
    return path


def one_marker(folder: Path, names: str = "BL") -> Path:
    """A mapping of two files that reads the named markers of the hand only."""
    text = TWO_DAYS.read_text()
    text = text.replace("undrawn: [BL, BR, TR, TL]", f"undrawn: [{names}]").replace(
        "TR: [x3, y3, z3], TL: [x4, y4, z4]", ""
    )
    if names == "BL":
        text = text.replace("BR: [x2, y2, z2], ", "")
    (folder / "one.yaml").write_text(text)
    return folder / "one.yaml"


def spoilt(positions: np.ndarray, rows: np.ndarray, kind: float | str, rng: np.random.Generator) -> np.ndarray:
    """Marker positions (n, m, 3) [m], in some rows all moved by `kind` in a random direction, or the first exchanged
    with another one."""
    wrong = positions.copy()
    for row in rows:
        if kind == "labels":
            other = rng.integers(1, positions.shape[1])
            wrong[row, [0, other]] = wrong[row, [other, 0]]
        else:
            way = rng.normal(size=3)
            wrong[row] += kind * way / np.linalg.norm(way)
    return wrong


def spoilt_rows(rows: np.ndarray, which: np.ndarray, kind: float | str, rng: np.random.Generator) -> np.ndarray:
    """The same of rows of the table."""
    markers = spoilt(rows[:, :12].reshape(-1, 4, 3), which, kind, rng)
    return np.hstack([markers.reshape(-1, 12), rows[:, 12:]])
