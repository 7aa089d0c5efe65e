"""Loops are compiled again when their source, what they call or their constants change."""

import subprocess
import sys
from importlib import util
from pathlib import Path

import pytest

from calibration.numerics import compiled

ROOT = Path(__file__).parents[3]
INNER = "from calibration.numerics.compiled import njit\n@njit(cache=True)\ndef inner(x):\n    return {} * x\n"
OUTER = "from calibration.numerics.compiled import njit\nfrom inner import inner\nADDED = {}\n"
OUTER += "@njit(cache=True)\ndef outer(x):\n    return inner(x) + ADDED\n"


def value(folder: Path, factor: float, added: float) -> float:
    (folder / "inner.py").write_text(INNER.format(factor))
    (folder / "outer.py").write_text(OUTER.format(added))
    script = f"import sys; sys.path[:0] = [{str(folder)!r}, {str(ROOT)!r}]; from outer import outer; print(outer(1.0))"
    done = subprocess.run([sys.executable, "-Bc", script], capture_output=True, text=True, check=True)
    return float(done.stdout)


@pytest.mark.slow
def test_a_loop_is_compiled_anew_with_what_it_calls(tmp_path):
    assert [value(tmp_path, *x) for x in ((2.0, 0.5), (3.0, 0.5), (2.0, 0.5))] == [2.5, 3.5, 2.5]


def test_a_digest_is_of_callees_and_constants(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)

    def digest(factor: float, added: float) -> str:
        compiled._digest_of.cache_clear()
        for name, text in (("inner", INNER.format(factor)), ("outer", OUTER.format(added))):
            (tmp_path / f"{name}.py").write_text(text)
            spec = util.spec_from_file_location(name, tmp_path / f"{name}.py")
            module = util.module_from_spec(spec)
            exec(compile(text, str(tmp_path / f"{name}.py"), "exec"), vars(module))
            monkeypatch.setitem(sys.modules, name, module)
        return compiled.digest(sys.modules["outer"].outer.py_func)

    found = [digest(2.0, 0.5), digest(3.0, 0.5), digest(2.0, 0.7), digest(2.0, 0.5)]
    assert found[0] == found[3] and len(set(found)) == 3


def test_no_thread_sees_a_loop_before_those_it_calls_are_compiled():
    class Slow(compiled.Kernel):
        def compiled(self):
            seen.append((outer._compiled, known["outer"]))
            return super().compiled()

    seen, known = [], {}
    exec("def inner(x):\n    return 2 * x\ndef outer(x):\n    return inner(x) + 1\n", known)
    outer = compiled.Kernel(known["outer"], {})
    known |= {"inner": Slow(known["inner"], {}), "outer": outer}
    assert outer(3) == 7 and seen[0] == (None, outer) and known["outer"] is not outer
