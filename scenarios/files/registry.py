"""The scenarios that come with the program: the YAML files of the package `scenarios`."""

import difflib
from pathlib import Path

from scenarios.files.errors import ScenarioError

HERE = Path(__file__).parents[1]


def names() -> tuple[str, ...]:
    """Names of the scenarios, sorted."""
    return tuple(sorted(path.stem for path in HERE.glob("*.yaml")))


def find(name_or_path: str | Path) -> Path:
    """Return the file of a scenario, given by its name or as a path.

    Raises:
        ScenarioError: There is none; the names that exist.
    """
    if str(name_or_path) in names():
        return HERE / f"{name_or_path}.yaml"
    path = Path(name_or_path)
    if path.is_file():
        return path
    close = difflib.get_close_matches(str(name_or_path), names(), n=3)
    hint = f"did you mean {' or '.join(close)}? " if close else ""
    raise ScenarioError(
        f"{name_or_path}: no such scenario and no such file; {hint}"
        f"the scenarios are {', '.join(names()) or '(none)'} (tiago-twin list); name a file of your own by its path"
    )
