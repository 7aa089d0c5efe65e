"""Throughput of `dataset`: two workers against one, real time, memory, size against what was announced.

BENCH_RUNS sets the number of runs (40) of two workers, one worker makes 100 of them at the most; 1000 take ten minutes.
"""

import os
import re
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import psutil

RUNS = int(os.environ.get("BENCH_RUNS", "40"))
DURATION = 20.0  # [s] simulated in a run of swing20


def memory_of(process: psutil.Process) -> int:
    """Resident bytes of a process and its children."""
    total = 0
    for one in (process, *process.children(recursive=True)):
        try:
            total += one.memory_info().rss
        except psutil.NoSuchProcess:
            continue
    return total


def watched(out: Path, workers: int, n: int) -> tuple[float, np.ndarray, int]:
    """Time from the first run to the last [s], memory [bytes] along the way, and bytes reported before the start."""
    code = "from scenarios.commands.main import main; main()"
    arguments = ["dataset", "swing20", "-n", str(n), "--workers", str(workers), "--out", str(out)]
    process = subprocess.Popen([sys.executable, "-c", code, *arguments], stderr=subprocess.PIPE, text=True)
    samples: list[int] = []

    def sample() -> None:
        while process.poll() is None:
            samples.append(memory_of(psutil.Process(process.pid)))
            time.sleep(1.0)

    watcher = threading.Thread(target=sample)
    watcher.start()
    reported = next(line for line in process.stderr if "in all" in line)
    start = time.monotonic()
    for _ in process.stderr:
        pass
    seconds = time.monotonic() - start
    watcher.join()
    size, unit = re.search(r"([\d.]+) (\w+) in all", reported).groups()
    return seconds, np.array(samples), int(float(size) * {"kB": 1e3, "MB": 1e6, "GB": 1e9}[unit])


def test_throughput(tmp_path, keep):
    figures: dict[str, float] = {"runs": RUNS}
    rate = {}
    for workers in (1, 2):
        out = tmp_path / f"w{workers}"
        n = RUNS if workers == 2 else min(RUNS, 100)
        seconds, memory, reported = watched(out, workers, n)
        rate[workers] = (n - 1) / seconds
        written = sum(p.stat().st_size for p in (out / "runs").rglob("*") if p.is_file() and p.name != "run.json")
        quarter = len(memory) // 4
        figures |= {
            f"dataset_{workers}_workers_real_time_factor": rate[workers] * DURATION,
            f"dataset_{workers}_workers_runs_per_hour": 3600.0 * rate[workers],
            f"dataset_{workers}_workers_memory_MB": float(memory.max()) / 1e6,
            f"dataset_{workers}_workers_memory_growth": float(
                np.median(memory[-quarter:]) / np.median(memory[quarter : 2 * quarter])
            ),
            f"dataset_{workers}_workers_bytes_over_announced": written / reported,
            "dataset_MB_per_run": written / n / 1e6,
        }
        shutil.rmtree(out)
    figures["dataset_2_workers_over_1"] = rate[2] / rate[1]
    keep(figures)
    assert abs(figures["dataset_2_workers_bytes_over_announced"] - 1.0) < 0.1
