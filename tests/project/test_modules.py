"""The walls of the project: who may import whom, what a module may do, what a wheel holds."""

import ast
import re
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("calibration", "mjcf", "scenarios", "twin")
FORBIDDEN = {
    "calibration": ("mjcf", "scenarios", "twin", "mujoco"),
    "mjcf": ("calibration", "scenarios", "twin", "pinocchio"),
    "twin": ("calibration", "scenarios", "pinocchio"),
    "scenarios": (),
}
ALLOWED = {"twin": ("calibration.recording", "calibration.schema", "calibration.netcdf")}
"""The recording format, which has no field for truth, and its kind of file."""

SIDE_EFFECTS = ("open", "read_text", "read_bytes", "loadtxt", "print", "ArgumentParser", "from_xml_path", "from_file")
LONGEST_FILE = 300
MOST_NAMES = 12


def sources() -> list[Path]:
    return sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))


@dataclass(frozen=True)
class Module:
    """A parsed module: its full name, its tree, and the package its relative imports start from."""

    name: str
    tree: ast.Module
    package: str


Modules = dict[str, Module]


def module(name: str, source: str) -> Module:
    """Return a module of a given text; `package.__init__` is the package itself."""
    package, _, own = name.rpartition(".")
    return Module(package if own == "__init__" else name, ast.parse(source), package)


@pytest.fixture(scope="module")
def modules() -> Modules:
    """Every module of the four packages, parsed."""
    found = (module(".".join(p.relative_to(ROOT).with_suffix("").parts), p.read_text("utf-8")) for p in sources())
    return {one.name: one for one in found}


def imports(one: Module, everywhere: bool = True) -> Iterator[str]:
    """Full names a module imports; unless `everywhere`, those imported when it is itself imported."""
    for node in ast.walk(one.tree) if everywhere else at_import(one.tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = one.package.split(".")[: -(node.level - 1) or None] if node.level else []
            origin = ".".join([*above, *([node.module] if node.module else [])])
            yield from (f"{origin}.{alias.name}" for alias in node.names)


def at_import(tree: ast.AST) -> Iterator[ast.AST]:
    """Nodes that run when a module is imported: not the bodies of functions, nor what only a type checker reads."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
            continue
        if isinstance(node, ast.If) and (
            "TYPE_CHECKING" in ast.unparse(node.test) or "__main__" in ast.unparse(node.test)
        ):
            continue
        yield node
        yield from at_import(node)


def within(name: str, packages: tuple[str, ...]) -> bool:
    return any(name == package or name.startswith(f"{package}.") for package in packages)


def wrong_imports(one: Module) -> list[str]:
    """Imports of a module that go against the arrows."""
    package = one.name.partition(".")[0]
    return [
        imported
        for imported in imports(one)
        if within(imported, FORBIDDEN[package]) and not within(imported, ALLOWED.get(package, ()))
    ]


def broad_handlers(tree: ast.Module) -> list[int]:
    """Lines that catch everything, and so hide mistakes of ours; `except BaseException` may only pass it on."""
    broad = []
    for node in ast.walk(tree):
        if isinstance(node, ast.ExceptHandler):
            caught = ast.unparse(node.type) if node.type else ""
            passed_on = isinstance(node.body[-1], ast.Raise) and node.body[-1].exc is None
            if re.search(r"\bException\b", caught) or (caught in ("", "BaseException") and not passed_on):
                broad.append(node.lineno)
    return broad


def side_effects(tree: ast.Module) -> list[int]:
    """Lines that do something when the module is imported, beside defining what it offers."""
    lines = []
    for node in tree.body:
        if isinstance(node, (ast.For, ast.While, ast.With, ast.Try)):
            lines.append(node.lineno)
        elif isinstance(node, ast.Expr) and not isinstance(node.value, ast.Constant):
            lines.append(node.lineno)
    for node in at_import(tree):
        if isinstance(node, ast.Call) and ast.unparse(node.func).rpartition(".")[2] in SIDE_EFFECTS:
            lines.append(node.lineno)
    return sorted(set(lines))


def cycle(graph: dict[str, set[str]]) -> list[str]:
    """Return a cycle of a graph as the names along it; [] where there is none."""
    done: set[str] = set()

    def search(node: str, path: list[str]) -> list[str]:
        if node in path:
            return [*path[path.index(node) :], node]
        if node in done:
            return []
        for after in sorted(graph[node]):
            if found := search(after, [*path, node]):
                return found
        done.add(node)
        return []

    return next((found for name in sorted(graph) if (found := search(name, []))), [])


def graph_of(modules: Modules) -> dict[str, set[str]]:
    """Which modules each module imports while it is itself imported."""
    graph: dict[str, set[str]] = {}
    for name, one in modules.items():
        targets = set()
        for imported in imports(one, everywhere=False):
            target = imported if imported in modules else imported.rpartition(".")[0]
            targets |= {target} & modules.keys() - {name}
        graph[name] = targets
    return graph


def test_the_import_arrows_hold(modules):
    assert {one.name: wrong for one in modules.values() if (wrong := wrong_imports(one))} == {}


@pytest.mark.parametrize(
    ("name", "source"),
    [
        ("calibration.stage", "import mujoco"),
        ("calibration.stage", "def f():\n    from twin.build import build"),
        ("calibration.stage", "from mjcf import urdf"),
        ("mjcf.urdf", "import calibration.recording"),
        ("twin.record", "from calibration import calibrate"),
        ("twin.record", "from calibration.geometry import fit"),
        ("twin.defects.gear", "from calibration.se3 import exp"),
        ("twin.record", "from calibration import *"),
    ],
)
def test_a_wrong_import_is_seen(name, source):
    assert wrong_imports(module(name, source))


def test_the_recording_format_is_open_to_the_twin():
    source = "from calibration import recording, schema\nfrom calibration.recording import Trial\nimport mjcf, mujoco"
    assert wrong_imports(module("twin.record", source)) == []


def test_no_imports_go_round_in_circles(modules):
    assert cycle(graph_of(modules)) == []


def circle_in(**texts: str) -> list[str]:
    parsed = [module(f"a.{name}", text) for name, text in texts.items()]
    return cycle(graph_of({one.name: one for one in parsed}))


def test_a_circle_is_seen():
    assert circle_in(__init__="import a.b", b="from a.c import x", c="from a import b") == ["a.b", "a.c", "a.b"]
    assert circle_in(b="from .c import x", c="from . import b") == ["a.b", "a.c", "a.b"]
    assert circle_in(__init__="from .b import x", b="from a import y") == ["a", "a.b", "a"]
    assert circle_in(b="from a.c import x", c="def f():\n    from a import b") == []


def test_nobody_catches_everything(modules):
    assert {name: lines for name, one in modules.items() if (lines := broad_handlers(one.tree))} == {}


@pytest.mark.parametrize("caught", ["", " Exception", " (ValueError, Exception)", " BaseException", " Exception as e"])
def test_catching_everything_is_seen(caught):
    assert broad_handlers(ast.parse(f"try:\n    f()\nexcept{caught}:\n    pass")) == [3]


def test_cleaning_up_and_passing_on_is_no_catching():
    assert broad_handlers(ast.parse("try:\n    f()\nexcept BaseException:\n    g()\n    raise")) == []


def test_importing_a_module_does_nothing(modules):
    assert {name: lines for name, one in modules.items() if (lines := side_effects(one.tree))} == {}


@pytest.mark.parametrize(
    "source",
    [
        "print(1)",
        "x = open('f')",
        "np.random.seed(0)",
        "for i in x:\n    pass",
        "TEXT = HERE.joinpath('f').read_text()",
    ],
)
def test_a_module_that_does_something_is_seen(source):
    assert side_effects(ast.parse(source)) == [1]


def test_importing_everything_reads_no_file_of_ours_and_says_nothing(modules):
    script = f"""
import importlib, sys
def watch(event, arguments):
    if event == "open" and isinstance(arguments[0], str):
        name = arguments[0]
        if name.startswith({str(ROOT) + "/"!r}) and "/.venv/" not in name and not name.endswith((".py", ".pyc")):
            if ".pyc." not in name:
                print("opened", name)
sys.addaudithook(watch)
for name in {sorted(modules)!r}:
    importlib.import_module(name)
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=ROOT)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_files_are_short_and_packages_offer_few_names(modules):
    long = {p.name: n for p in sources() if (n := len(p.read_text(encoding="utf-8").splitlines())) > LONGEST_FILE}
    assert long == {}
    for package in PACKAGES:
        offered = [
            ast.literal_eval(node.value)
            for node in modules[package].tree.body
            if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__"
        ]
        assert all(len(names) <= MOST_NAMES for names in offered), package


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="compares with the files under version control")
def test_the_wheel_holds_the_four_packages_with_their_data_and_nothing_else(tmp_path):
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    held = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", *PACKAGES],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    )
    assert held == set(listed.stdout.split())
    assert {Path(name).suffix for name in held} >= {".py", ".xml", ".yaml"}
