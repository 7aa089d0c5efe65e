"""Loops over scalars, compiled by numba when they are first called: a command that calls none does not import numba."""

from collections.abc import Callable
from functools import update_wrapper
from threading import RLock
from typing import Any, TypeVar, cast

F = TypeVar("F", bound=Callable[..., Any])
_compiling = RLock()  # threads that call a kernel first at the same time compile it once


class Kernel:
    """A function and, from its first call on, its compiled form; other kernels it calls are compiled with it."""

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        """Keep what `numba.njit` needs."""
        self._function, self._options, self._compiled = function, options, None
        update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        """The function's value."""
        return (self._compiled or self.compiled())(*arguments)

    def compiled(self) -> Any:
        """Numba's form of the function; in its module compiled kernels replace this one and those that it calls."""
        with _compiling:
            if self._compiled is None:
                from numba import njit as compile_

                self._compiled = compile_(nogil=True, **self._options)(self._function)
                known = self._function.__globals__
                for name in (self._function.__name__, *self._function.__code__.co_names):
                    if isinstance(other := known.get(name), Kernel):
                        known[name] = other.compiled()
            return self._compiled


def njit(**options: Any) -> Callable[[F], F]:
    """Decorator like `numba.njit`, which is imported with the first call."""

    def decorated(function: F) -> F:
        return cast(F, Kernel(function, options))

    return decorated
