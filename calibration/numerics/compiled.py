"""Loops over scalars, compiled by numba when they are first called: a command that calls none does not import numba.

Compiled code is cached beside this package, in a folder named by a digest of the source files of a loop and of those it
calls, and of their constants: numba compares the loop's own file alone.
"""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache, update_wrapper
from hashlib import sha256
from pathlib import Path
from threading import RLock
from types import FunctionType
from typing import Any, TypeVar, cast

F = TypeVar("F", bound=Callable[..., Any])
_compiling = RLock()  # threads that call a kernel first at the same time compile it once
_KEPT = Path(__file__).parents[1] / "__pycache__" / "kernels"
_CONSTANTS = (bool, int, float, complex, str, tuple)


class Kernel:
    """A function and, from its first call on, its compiled form; other kernels it calls are compiled with it."""

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        """Keep what `numba.njit` needs."""
        self._function, self._options, self._compiled = cast(FunctionType, function), options, None
        update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        """The function's value."""
        return (self._compiled or self.compiled())(*arguments)

    def compiled(self) -> Any:
        """Numba's form of the function; in its module compiled kernels replace this one and those that it calls."""
        with _compiling:
            if self._compiled is None:
                from numba import njit as compile_

                options: dict[str, Any] = {"nogil": True, "no_cfunc_wrapper": True, **self._options}  # no C calls it
                with _kept_in(_KEPT / digest(self._function)):
                    own = compile_(**options)(self._function)
                known = self._function.__globals__
                for name in (*self._function.__code__.co_names, self._function.__name__):  # itself once it is whole
                    if isinstance(other := known.get(name), Kernel):
                        known[name] = own if other is self else other.compiled()
                self._compiled = own  # the last: other threads call it at once
            return self._compiled

    @property
    def py_func(self) -> FunctionType:
        """The function that is compiled, as numba's form names it."""
        return self._function


def njit(**options: Any) -> Callable[[F], F]:
    """Decorator like `numba.njit`, which is imported with the first call."""

    def decorated(function: F) -> F:
        return cast(F, Kernel(function, options))

    return decorated


def digest(function: FunctionType) -> str:
    """Of all that the compiled form of a function is made of."""
    parts = set()
    for one in _called(function, {}).values():
        parts.add(_digest_of(one.__code__.co_filename))
        values = ((name, one.__globals__.get(name)) for name in one.__code__.co_names)
        parts |= {f"{name} = {x!r}" for name, x in values if isinstance(x, _CONSTANTS) or hasattr(x, "tobytes")}
    return sha256("\n".join(sorted(parts)).encode()).hexdigest()[:16]


def _called(function: FunctionType, found: dict[int, FunctionType]) -> dict[int, FunctionType]:
    """The function and all compiled ones that it calls, by their identity."""
    if id(function) not in found:
        found[id(function)] = function
        for name in function.__code__.co_names:
            other = getattr(function.__globals__.get(name), "py_func", None)
            if isinstance(other, FunctionType):
                _called(other, found)
    return found


@lru_cache(maxsize=256)
def _digest_of(file: str) -> str:
    path = Path(file)
    return sha256(path.read_bytes()).hexdigest() if path.is_file() else file


@contextmanager
def _kept_in(folder: Path) -> Iterator[None]:
    """Let numba keep what is made now in a folder, unless the user names another or it cannot be written."""
    from numba import config

    before = config.CACHE_DIR
    if not before and os.access(_KEPT.parents[1], os.W_OK):
        config.CACHE_DIR = str(folder)
    try:
        yield
    finally:
        config.CACHE_DIR = before
