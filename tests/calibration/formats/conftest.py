"""A laboratory's folder of files, and the import command run on them."""

import json
from pathlib import Path

import pytest

from scenarios.commands import main
from scenarios.steps import import_export


@pytest.fixture
def lab(tmp_path):
    return Laboratory(tmp_path)


class Laboratory:
    """A folder with files and a mapping, and the command run on them."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.out = folder, folder / "out"

    def run(self, described: dict, *files: Path, kind: str = "csv") -> tuple[str, ...]:
        path = self.folder / "map.yaml"
        path.write_text(json.dumps(described))  # JSON is YAML
        return import_export.import_files(kind, files, path, self.out)

    def refused(self, capsys, described: dict, *files: Path, kind: str = "csv") -> str:
        """What the command says when it ends with 2 and writes nothing."""
        path = self.folder / "map.yaml"
        path.write_text(json.dumps(described))  # JSON is YAML
        before = sorted(self.folder.rglob("*"))
        with pytest.raises(SystemExit) as exit:
            main.main(["import", kind, *map(str, files), "--map", str(path), "--out", str(self.out)])
        assert exit.value.code == 2 and sorted(self.folder.rglob("*")) == before
        return capsys.readouterr().err
