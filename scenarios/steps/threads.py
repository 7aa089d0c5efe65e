"""Threads of the linear algebra libraries."""

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Keep linear algebra on one thread: faster for small matrices, and the same bits on any number of cores."""
    import scipy.linalg  # noqa: F401  only what is loaded can be limited
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1, "blas"):
        yield
