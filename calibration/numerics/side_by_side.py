"""Independent parts of a computation on several cores: the same values, in the same order, on any number of them.

Threads: linear algebra and compiled loops hold no interpreter lock. One core unless `on_cores` allows more, so that
whoever runs many robots at once decides himself.
"""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, TypeVar

T = TypeVar("T")
_cores = ContextVar("cores", default=1)


@contextmanager
def on_cores(number: int) -> Iterator[None]:
    """Let parts be computed on so many cores at once."""
    token = _cores.set(number)
    try:
        yield
    finally:
        _cores.reset(token)


def side_by_side(part: Callable[..., T], *arguments: Iterable[Any]) -> list[T]:
    """[part(a, b, ...) for a, b, ... in zip(arguments)]; an exception is that of the first part that fails."""
    given = list(zip(*arguments, strict=True))
    threads = min(_cores.get(), len(given))
    if threads < 2:
        return [part(*of_one) for of_one in given]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(lambda of_one: part(*of_one), given))
