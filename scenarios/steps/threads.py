"""Threads of a step: one for linear algebra, one for each core this process may use for independent parts."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module

_LATER = ("twin.campaign", "calibration.pipeline", "scenarios.score.score", "scenarios.report.page", "numba")


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Keep linear algebra on one thread: faster for small matrices, and the same bits on any number of cores."""
    import scipy.linalg  # noqa: F401  only what is loaded can be limited
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1, "blas"):
        yield


@contextmanager
def every_core() -> Iterator[None]:
    """`one_blas_thread`, and independent parts on all cores of this process: the same bits on any number of them."""
    from calibration.numerics import on_cores

    affinity = getattr(os, "sched_getaffinity", None)  # Linux
    cores = len(affinity(0)) if affinity else os.cpu_count() or 1
    with one_blas_thread(), on_cores(cores):
        yield


def import_ahead() -> None:
    """Import what the steps of a run need after the simulation, whose loops hold no interpreter lock.

    First what the simulation needs itself, so that two threads never import in different orders.
    """
    for name in _LATER:
        import_module(name)
