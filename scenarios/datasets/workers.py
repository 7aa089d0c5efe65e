"""Who computes the runs: this process, workers of its own, or a scheduler that is already there; one code path.

Each of them offers `submit`, which returns a future. Only a few runs are on their way at any time, so that memory
does not grow with their number, and a run that takes its worker down takes no other run with it.
"""

import logging
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING

from scenarios.datasets.index import Row
from scenarios.datasets.run_one import perform
from scenarios.datasets.run_spec import Order
from scenarios.files.errors import ScenarioError

if TYPE_CHECKING:
    from distributed import Client

_TRIES = 3  # of a run that takes its worker down, before it is given up
_AGAIN = "run the same command again, complete runs are kept"
_PROBE = 4_000_000  # bytes that must still find room for a failure to be the run's own
# The profiler costs a tenth; looking at clocks, memory and tasks many times a second 3 %, and runs take seconds.
_QUIET = {
    "logging.distributed": "critical",
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "500ms",
    "distributed.admin.system-monitor.interval": "10s",
    "distributed.scheduler.work-stealing-interval": "2s",
    "distributed.worker.memory.monitor-interval": "1s",
}
_LOOPBACK = "127.0.0.1"  # whoever reaches a scheduler may run code there
_PATIENCE = "20s"  # for a scheduler to answer
_LOOK, _GONE = 10.0, 6  # [s] between looks for a worker while nothing ends; looks without one


Task = Callable[[Order], Row]


@dataclass(frozen=True)
class Workers:
    """Who computes.

    Attributes:
        number: Worker processes; 0: this one.
        scheduler: Address of a running scheduler, `tcp://host:port`; None: our own.
    """

    number: int = 0
    scheduler: str | None = None


class SchedulerLost(ScenarioError):
    """The scheduler went away, or was never there."""


class NoRoom(OSError):
    """Nothing can be written any more."""


@dataclass(frozen=True)
class _Pool:
    """What runs tasks, how many at once, and whether anybody is there to run them."""

    executor: Executor
    width: int
    manned: Callable[[], bool] = lambda: True


@dataclass(frozen=True)
class Done:
    """A run that ended, and how long it took its worker [s]."""

    row: Row
    seconds: float


def compute(orders: Iterable[Order], workers: Workers, task: Task = perform) -> Iterator[Done]:
    """Yield each run as it ends, the first before any other starts: it shows what the others will cost.

    Args:
        orders: What to make.
        workers: Who computes.
        task: What makes one.

    Raises:
        SchedulerLost: The scheduler cannot be reached, or went away; what is complete stays.
        NoRoom: The disk is full, or must not be written; what is complete stays.
    """
    todo = iter(orders)
    first = next(todo, None)
    if first is None:
        return
    with _pool(workers) as pool:
        pending = {pool.executor.submit(_timed, task, first): first}
        without = 0
        while pending:
            done, _ = wait(pending, timeout=_LOOK, return_when=FIRST_COMPLETED)
            without = 0 if done or pool.manned() else without + 1
            if without == _GONE:
                raise SchedulerLost(f"no worker has been there for {_LOOK * _GONE:.0f} s; start one and {_AGAIN}")
            for future in done:
                yield _ended(pending.pop(future), future)
            more = islice(todo, pool.width - len(pending))
            pending |= {pool.executor.submit(_timed, task, order): order for order in more}


def _timed(task: Task, order: Order) -> Done:
    start = time.monotonic()
    row = task(order)
    return Done(row, time.monotonic() - start)


def _ended(order: Order, future: "Future[Done]") -> Done:
    """How a run ended; a mistake of its own is its row, and not the end of the others."""
    if future.cancelled():
        raise SchedulerLost(f"the scheduler went away; start it again and {_AGAIN}")
    error = future.exception()
    if error is None:
        return future.result()
    _check_room(order.folder, error)
    if type(error).__name__ == "KilledWorker":
        reason = f"took its worker down {_TRIES} times: out of memory, or a crash of native code"
        return Done(Row(order.id, "killed", reason), 0.0)
    return Done(Row(order.id, "failed", " ".join(f"{type(error).__name__}: {error}".split())), 0.0)


def _check_room(folder: Path, cause: BaseException) -> None:
    """A failure while nothing can be written says nothing about the run."""
    try:
        with TemporaryFile(dir=folder) as probe:
            probe.write(bytes(_PROBE))
            probe.flush()
    except OSError as error:
        raise NoRoom(f"{folder}: cannot be written ({error.strerror}); make room and {_AGAIN}") from cause


@contextmanager
def _pool(workers: Workers) -> Iterator[_Pool]:
    if workers.scheduler is None and workers.number == 0:
        with ThreadPoolExecutor(1) as executor:
            yield _Pool(executor, 1)
        return
    with _client(workers) as client:
        width = workers.number or len(client.scheduler_info(n_workers=-1)["workers"])
        if width == 0:
            raise SchedulerLost(f"{workers.scheduler}: has no worker; start one with: dask worker {workers.scheduler}")
        yield _Pool(
            client.get_executor(pure=False), width, lambda: bool(client.scheduler_info(n_workers=-1)["workers"])
        )


@contextmanager
def _client(workers: Workers) -> Iterator["Client"]:
    try:
        import dask

        dask.config.set(_QUIET)  # read when `distributed` is imported
        from distributed import Client, LocalCluster
    except ModuleNotFoundError as error:
        raise ScenarioError(
            "--workers and --scheduler need dask.distributed; install the extra: pip install '.[cluster]'"
        ) from error
    with dask.config.set({"distributed.scheduler.allowed-failures": _TRIES - 1}):
        if workers.scheduler is None:
            options = {"threads_per_worker": 1, "dashboard_address": None, "silence_logs": logging.CRITICAL}
            with (
                LocalCluster(n_workers=workers.number, host=_LOOPBACK, **options) as cluster,
                Client(cluster) as client,
            ):
                yield client
            return
        try:
            client = Client(workers.scheduler, timeout=_PATIENCE)
        except (OSError, ValueError) as error:
            raise SchedulerLost(f"{workers.scheduler}: no scheduler answers there ({error})") from error
        with client:
            yield client
