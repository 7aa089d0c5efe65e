"""A scenario file that says what differs from another scenario, which may itself be such a file."""

import re
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field
from ruamel.yaml.comments import CommentedMap

from scenarios.files import registry, yaml_file
from scenarios.files.errors import ScenarioError
from scenarios.files.overrides import Override, place


def _path(text: str) -> str:
    if not all(text.split(".")):
        raise ValueError("write path.to.field")
    return text


class Extension(BaseModel):
    """A scenario that is another one but for some values.

    Attributes:
        name: Its name; the file's unless given.
        description: One line; the other one's unless given.
        extends: The other one: a name from `tiago-twin list`, or a file, beside this one or from the current folder.
        set: Values by `path.to.field`.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$")] | None = None
    description: str | None = None
    extends: str
    set: Annotated[dict[Annotated[str, AfterValidator(_path)], Any], Field(default_factory=dict)]

    def overrides(self, file: str, tree: CommentedMap) -> list[Override]:
        """Its values as they are put into the other one; `tree` is what `file` holds."""
        stem = re.sub(r"[^A-Za-z0-9_-]", "_", Path(file).stem)
        named = [Override("name", stem, file, tree)] if self.name is None else []
        given = [Override(key, value, file, tree) for key in ("name", "description") if (value := getattr(self, key))]
        return [*named, *given, *(Override(path, value, file, tree["set"]) for path, value in self.set.items())]


def resolve(path: Path) -> tuple[Path, list[Override]]:
    """Follow a file to the one that extends no other; what is put into that one on the way back, in this order.

    Raises:
        ScenarioError: A file on the way is wrong, extends what does not exist, or extends itself in the end.
    """
    above: list[Path] = []
    overrides: list[Override] = []
    while "extends" in (tree := yaml_file.mapping(path)):
        extension = yaml_file.read(path, Extension)
        overrides = extension.overrides(str(path), tree) + overrides
        above.append(path)
        line, column, _ = place(tree, ("extends",), of_key=False)
        where = f"{path}:{line + 1}:{column + 1}: extends"
        path = _extended(extension.extends, path, where)
        if any(path.samefile(other) for other in above):
            chain = " extends ".join(map(str, (*above, path)))
            raise ScenarioError(f"{where}: {chain}; a scenario cannot extend itself")
    return path, overrides


def _extended(name: str, path: Path, where: str) -> Path:
    """The file that `path` extends."""
    beside = path.parent / name
    if name not in registry.names() and beside.is_file():
        return beside
    try:
        return registry.find(name)
    except ScenarioError as error:
        raise ScenarioError(f"{where}: {error}") from error
