"""What a user waits for and a machine must hold: start of the command, memory of the main job."""

import os
import subprocess
import sys
import time

LIGHT = "from scenarios.cli import main; main()"


def child(code: str, *arguments: str) -> tuple[float, float]:
    """Seconds and peak memory [MB] of a Python process of its own."""
    start = time.monotonic()
    process = subprocess.Popen([sys.executable, "-c", code, *arguments], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    assert status == 0, (code, arguments)
    return time.monotonic() - start, usage.ru_maxrss / 1024.0


def test_start_and_memory(tmp_path, keep):
    starts = {
        "start_python_s": ("pass",),
        "start_help_s": (LIGHT, "--help"),
        "start_import_calibration_s": ("import calibration",),
        "start_import_twin_s": ("import twin",),
    }
    figures = {name: min(child(*what)[0] for _ in range(3)) for name, what in starts.items()}
    seconds, memory = child(LIGHT, "run", "humanoids2024", "--out", str(tmp_path / "run"))
    keep(figures | {"default_run_s": seconds, "default_run_peak_MB": memory})
