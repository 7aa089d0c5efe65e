"""The command in a child process with bounds of memory and time: whatever a file does to it, the tests go on.

The child is forked, so that what this process has imported costs it nothing; it writes to pipes of its own.
"""

import os
import resource
import signal
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

MEMORY = 2 * 2**30
"""What a command may take [B]."""

SECONDS = 60
"""What a command may take of a processor [s]; three times as long by the clock, for a machine that is busy."""


@dataclass(frozen=True)
class Outcome:
    """What became of a command.

    Attributes:
        code: Exit code; minus the signal that ended it.
        output: What it wrote, both streams.
        memory: The most it had at once, beyond what this process had when it was forked [B].
        seconds: What it took of a processor [s].
    """

    code: int
    output: str
    memory: float
    seconds: float

    @property
    def faults(self) -> tuple[str, ...]:
        """What no input may do."""
        found = {
            "traceback": "Traceback (most recent call last)" in self.output,
            "crash": self.code in (-signal.SIGSEGV, -signal.SIGABRT, -signal.SIGBUS, -signal.SIGFPE),
            "time": self.code in (-signal.SIGALRM, -signal.SIGXCPU) or self.seconds > SECONDS,
            "memory": self.memory > MEMORY or "MemoryError" in self.output,
        }
        return tuple(name for name, is_so in found.items() if is_so)


def command(arguments: Sequence[str], folder: Path | None = None, seconds: int = SECONDS) -> Outcome:
    """Run `tiago-twin` with arguments in a folder."""
    from scenarios.commands import main

    return forked(lambda: main.main(list(arguments)), folder, seconds)


def forked(work: Callable[[], None], folder: Path | None = None, seconds: int = SECONDS) -> Outcome:
    """Do some work in a child process."""
    with tempfile.TemporaryFile() as stream:
        before = _has("RssAnon")
        child = os.fork()
        if child == 0:
            _child(work, stream.fileno(), folder, seconds)
        _, status, used = os.wait4(child, 0)
        stream.seek(0)
        output = stream.read(2**20).decode("utf-8", "replace")
    code = os.waitstatus_to_exitcode(status)
    return Outcome(code, output, max(1024.0 * used.ru_maxrss - before, 0.0), used.ru_utime + used.ru_stime)


def _child(work: Callable[[], None], stream: int, folder: Path | None, seconds: int) -> None:
    """Never returns."""
    code = 1
    try:
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(3 * seconds)
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
        resource.setrlimit(resource.RLIMIT_DATA, (MEMORY + _has("VmData"), resource.RLIM_INFINITY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        os.dup2(stream, 1)
        os.dup2(stream, 2)
        sys.stdout = open(1, "w", encoding="utf-8", errors="replace", closefd=False)  # noqa: SIM115
        sys.stderr = open(2, "w", encoding="utf-8", errors="replace", closefd=False)  # noqa: SIM115
        if folder is not None:
            os.chdir(folder)
        code = _code_of(work)
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _code_of(work: Callable[[], None]) -> int:
    try:
        work()
    except SystemExit as error:
        return int(error.code or 0)
    except BaseException:  # noqa: BLE001  shown as Python shows it
        sys.excepthook(*sys.exc_info())
        return 1
    return 0


def _has(kind: str) -> int:
    """Memory of this process [B]: VmData, asked for, or RssAnon, which a child shares at first."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(f"{kind}:"):
            return 1024 * int(line.split()[1])
    return 0
