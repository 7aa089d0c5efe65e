"""What a run of a collection costs, and how that grows: processor time, bytes; duration, rates, degrees of freedom."""

import shutil
import time

import pytest

from scenarios import load
from scenarios.datasets.run_content import recordings_and_truth
from scenarios.datasets.run_one import size

SWING = "twin.campaign.calibration_swing"
VARIED = {
    "7 s": (f"{SWING}=7",),
    "17 s": (),
    "37 s": (f"{SWING}=37",),
    "77 s": (f"{SWING}=77",),
    "mocap 200 Hz": ("twin.instruments.mocap_rate=200",),
    "plate 2 kHz": ("twin.instruments.plate_rate=2000",),
    "anchored wheels": ("twin.base.wheels=anchored",),
    "friction-held gears": ("twin.gear_form=friction_held",),
}


@pytest.mark.parametrize("what", VARIED)
def test_cost_of_a_run(what, tmp_path, keep):
    scenario = load("swing20", VARIED[what])
    times = []
    for k in range(3):
        folder = tmp_path / str(k)
        folder.mkdir()
        start = time.process_time()
        recordings_and_truth(scenario, folder)
        times.append(time.process_time() - start)
    written = size(folder)
    shutil.rmtree(tmp_path)
    keep({f"run_cpu_s[{what}]": min(times), f"run_MB[{what}]": written / 1e6})
