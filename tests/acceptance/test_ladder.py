"""The ladder's claims on robots that no method was developed on: a band for each row, on fixed and on sampled arms."""

import numpy as np
import pytest

from tests.acceptance.series import SAMPLED, Key, series

pytestmark = pytest.mark.slow
SEEDS = range(1000, 1010)

BANDS = {
    # row: [median at most, worst at most] of ten robots, mm per component against the truth, dynamic trials
    Key("registration"): (8.8, 9.5),
    Key("model_2"): (1.8, 2.2),
    Key("model_3"): (1.45, 1.8),
    Key("model_2", "measured"): (1.6, 2.0),
    Key("model_3", "measured"): (1.15, 1.5),
    Key("full"): (0.45, 0.7),
    Key("full", "dynamics"): (0.65, 1.0),
    Key("full", "measured"): (0.45, 0.7),
    Key("floor", "measured", "link"): (0.25, 0.3),
}


@pytest.fixture(scope="module", params=["fixed", "sampled"])
def robots(request, tmp_path_factory):
    overrides = SAMPLED if request.param == "sampled" else ()
    return request.param, series(tmp_path_factory.mktemp(request.param), SEEDS, overrides)


@pytest.mark.parametrize("key", BANDS, ids=lambda key: "-".join((key.model, key.base, key.encoder)))
def test_each_row_lies_in_its_band(robots, key, claim):
    arms, found = robots
    mm = found.figures(key)
    claim(f"ladder/{arms}/{key.model}/{key.base}/{key.encoder}/{key.trials}", mm)
    if arms == "fixed":
        assert np.median(mm) <= BANDS[key][0]
        assert mm.max() <= BANDS[key][1]


def test_the_rows_keep_their_order_on_every_robot(robots):
    _, found = robots
    nominal, registration, model_2, model_3 = (
        found.figures(Key(name, base))
        for name, base in (("nominal", "fixed"), ("registration", "plate"), ("model_2", "plate"), ("model_3", "plate"))
    )
    assert (model_2 < np.minimum(nominal, registration)).all()
    assert (model_3 <= 1.1 * model_2).all()


@pytest.mark.parametrize(("axis", "least"), [("roll", 0.97), ("pitch", 0.95)])
def test_the_tilt_of_the_base_is_predicted_from_the_plate(robots, axis, least, claim):
    arms, found = robots
    r2 = found.base_r2(axis)
    claim(f"base/{arms}/{axis}_r2", r2)
    assert r2.min() >= least
