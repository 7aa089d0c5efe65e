"""Time of each stage of a calibration against the number of postures, on one core, and of a prediction."""

import time

import pytest

import calibration
import twin
from scenarios import load

POSTURES = (20, 40, 80, 160)


class Clock:
    """Processor time spent in each stage, reported by the progress of the pipeline."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._stage, self._since = "", time.process_time()

    def __call__(self, stage: str, share: float) -> None:
        now = time.process_time()
        if self._stage:
            self.seconds[self._stage] = self.seconds.get(self._stage, 0.0) + now - self._since
        self._stage, self._since = stage, now


@pytest.mark.parametrize("postures", POSTURES)
def test_stages_against_postures(postures, tmp_path, keep):
    scenario = load("humanoids2024", [f"twin.campaign.calibration_postures={postures}"])
    start = time.process_time()
    twin.record(scenario.twin, scenario.seed, tmp_path)
    figures = {f"stage_record_s[{postures}]": time.process_time() - start}
    dataset = calibration.load(tmp_path / "dataset")
    clock = Clock()
    estimate = calibration.calibrate(dataset, progress=clock)
    figures |= {f"stage_{name}_s[{postures}]": seconds for name, seconds in clock.seconds.items()}
    start = time.process_time()
    calibration.evaluate(estimate, dataset)
    keep(figures | {f"stage_evaluate_s[{postures}]": time.process_time() - start})
