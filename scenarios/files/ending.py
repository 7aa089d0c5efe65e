"""How a command ends: the input's fault in lines without a traceback, a mistake of this program with one.

0: done. 1: the simulation or the fit failed, its result must not be used, or the machine has no room. 2: wrong input.
"""

import errno
import os
import sys
import traceback
from types import TracebackType

import typer

from scenarios.files.errors import ScenarioError

FAILED, WRONG_INPUT = 1, 2
_MACHINE = {
    errno.ENOSPC,
    errno.EDQUOT,
    errno.EFBIG,
    errno.EROFS,
    errno.EIO,
    errno.EMFILE,
    errno.ENFILE,
    errno.ENOMEM,
    errno.EPIPE,
}
OUR_MISTAKE = "This is a mistake of tiago-twin, not of your input: please report it with the command and these lines."


class Ending:
    """A block whose errors end the process: known ones in a message, others with a traceback that says so."""

    def __enter__(self) -> None:
        """Nothing to prepare."""

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        """End the process where the error is a known one."""
        found = None if error is None else ending_of(error)
        if found is not None:
            message, code = found
            typer.echo("\n".join([message, *getattr(error, "__notes__", ())]), err=True)
            sys.exit(code)
        if isinstance(error, Exception):
            error.add_note(OUR_MISTAKE)


def ending_of(error: BaseException) -> tuple[str, int] | None:
    """Message and exit code of an error that is no mistake of this program; None of one that is, or of none."""
    if isinstance(error, ScenarioError) or _is(error, "InputError"):
        return str(error), WRONG_INPUT
    if _is(error, "CalibrationError", "TwinError"):
        return str(error), FAILED
    if isinstance(error, OSError):
        return str(error), FAILED if error.errno in _MACHINE or error.errno is None else WRONG_INPUT
    if isinstance(error, MemoryError):
        return f"more memory is needed than there is ({str(error) or 'no size'}); shorten the recordings", FAILED
    if isinstance(error, UnicodeEncodeError):
        return f"{error.object!r}: a name that is not UTF-8 text; rename the file or folder", WRONG_INPUT
    if isinstance(error, AttributeError | ImportError | RuntimeError) and _of_importing_mujoco(error):
        setting = os.environ.get("MUJOCO_GL", "")
        return f"MuJoCo cannot be imported ({error}) with MUJOCO_GL={setting!r}; unset it, or set it to off", FAILED
    return _breakdown(error)


def _breakdown(error: BaseException) -> tuple[str, int] | None:
    """Of a breakdown of the numbers outside the calibration's stages."""
    if "numpy" not in sys.modules:
        return None
    from calibration.breakdown import failure_of

    found = failure_of(error, "tiago-twin")
    return None if found is None else (str(found), FAILED)


def _is(error: BaseException, *names: str) -> bool:
    """Whether it is one of the engines' errors, of those that are imported: the others raised nothing."""
    modules = [sys.modules[name] for name in ("calibration.errors", "twin.errors") if name in sys.modules]
    return isinstance(error, tuple(getattr(m, name) for m in modules for name in names if hasattr(m, name)))


def _of_importing_mujoco(error: BaseException) -> bool:
    """Whether MuJoCo was being imported: it looks for a graphics driver then, and lets pass what that raises."""
    names = (str(frame.f_globals.get("__name__")) for frame, _ in traceback.walk_tb(error.__traceback__))
    return "mujoco" not in sys.modules and any(name.partition(".")[0] == "mujoco" for name in names)
