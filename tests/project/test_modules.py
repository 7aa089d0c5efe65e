"""What a module may do, how large files and folders are, what a wheel holds."""

import ast
import re
import subprocess
import sys
import zipfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("calibration", "mjcf", "scenarios", "twin")

SIDE_EFFECTS = ("open", "read_text", "read_bytes", "loadtxt", "print", "ArgumentParser", "from_xml_path", "from_file")
LONGEST_FILE = 300
MOST_FILES = 14
MOST_NAMES = 12
ROBOT = re.compile(r"tiago(?!-twin)|gripper|torso|arm_\d", re.I)


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
            if ".pyc." not in name and "__pycache__" not in name:  # numba looks for compiled kernels
                print("opened", name)
sys.addaudithook(watch)
for name in {sorted(modules)!r}:
    try:
        importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name not in ("trimesh", "viser"):  # of the extra `view`
            raise
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=ROOT)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_files_and_folders_are_small_and_packages_offer_few_names(modules):
    long = {p.name: n for p in sources() if (n := len(p.read_text(encoding="utf-8").splitlines())) > LONGEST_FILE}
    assert long == {}
    folders = Counter(path.parent for path in (*sources(), *(ROOT / "tests").rglob("*.py")))
    assert {f: n for f, n in folders.items() if n > MOST_FILES and f != ROOT / "scenarios"} == {}
    for name, one in modules.items():
        for node in one.tree.body:
            if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
                assert len(ast.literal_eval(node.value)) <= MOST_NAMES, name


def named_in(tree: ast.Module) -> list[str]:
    """Strings of a module, documentation aside, that name a robot or its joints and links."""
    documents = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    strings = (n for n in ast.walk(tree) if isinstance(n, ast.Constant) and isinstance(n.value, str))
    return [n.value for n in strings if id(n) not in documents and ROBOT.search(n.value)]


def test_calibration_names_no_robot(modules):
    found = {name: named_in(m.tree) for name, m in modules.items() if name.startswith("calibration.")}
    assert len(found) > 100 and {name: texts for name, texts in found.items() if texts} == {}
    assert named_in(ast.parse('"""Of arm_1."""\nlink = "arm_1_link"')) == ["arm_1_link"]


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
    plugin = {"scenarios/testing/pytest_plugin.py": "tiago_twin_pytest.py"}
    assert held == {plugin.get(name, name) for name in listed.stdout.split()}
    assert {Path(name).suffix for name in held} >= {".py", ".xml", ".yaml"}
