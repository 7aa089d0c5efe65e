"""What a user waits for and a machine must hold: start of the command, memory of the main job."""

import subprocess
import sys
import time

LIGHT = "from scenarios.commands.main import main; main()"
SMALL = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, check=True)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024)
"""


def child(code: str, *arguments: str) -> tuple[float, float]:
    """Seconds and peak memory [MB] of a Python process of its own.

    A small one starts it: the peak of a process counts from its fork, when it is still as large as its parent.
    """
    start = time.monotonic()
    command = [sys.executable, "-c", SMALL, sys.executable, "-c", code, *arguments]
    said = subprocess.run(command, stdout=subprocess.PIPE, check=True, text=True).stdout
    return time.monotonic() - start, float(said.splitlines()[-1])


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
