"""The ladder's claims on robots that no method was developed on: a band for each row, on fixed and on sampled arms."""

import numpy as np
import pytest

from tests.acceptance.series import MANY, SAMPLED, Key, kept_series

pytestmark = pytest.mark.slow
MM, DEG = "position_rmse_component_mm", "orientation_rmse_deg"

BANDS = {
    # row: [median at most, worst at most] of the fixed arms, mm per component and degrees, against the truth
    Key("registration"): ((8.8, 9.5), (5.5, 6.0)),
    Key("model_2"): ((1.8, 2.2), (1.0, 1.2)),
    Key("model_3"): ((1.45, 1.8), (0.55, 0.7)),
    Key("model_2", "measured"): ((1.6, 2.0), (1.0, 1.2)),
    Key("model_3", "measured"): ((1.15, 1.5), (0.55, 0.7)),
    Key("full"): ((0.45, 0.7), (0.18, 0.36)),
    Key("full", "dynamics"): ((0.65, 1.0), (0.18, 0.36)),
    Key("full", "measured"): ((0.42, 0.7), (0.13, 0.26)),
    Key("full", "plate", trials="static"): ((0.8, 1.6), (0.2, 0.4)),
    Key("full", "measured", "link"): ((0.26, 0.52), (0.08, 0.16)),
    Key("floor", "measured", "link"): ((0.25, 0.3), (0.05, 0.06)),
}
SPREAD = 1.3  # by which errors of `full` may be larger on sampled arms
INSIDE = {
    # row: share of the errors inside the 95 % band, all robots together, at least and at most
    Key("full"): (0.92, 0.98),
    Key("full", "dynamics"): (0.92, 0.98),
    Key("full", "measured"): (0.92, 0.98),
    Key("full", "plate", trials="static"): (0.92, 0.98),
    Key("full", "measured", trials="static"): (0.92, 0.98),
    Key("full", "dynamics", trials="static"): (0.92, 0.98),
    Key("model_3"): (0.92, 0.98),
    Key("model_2"): (0.92, 0.98),
    Key("model_2", "measured"): (0.92, 0.98),
    Key("registration"): (0.92, 0.98),
}
OPEN = {  # lines that do not hold, with their sizes in docs/limits.md
    "sampled, pitch",
    "fixed, ladder of model_2 plate motor dynamic",
    "fixed, ladder of model_2 measured motor dynamic",
    "fixed, band of full plate dynamic",
    "fixed, band of full dynamics dynamic",
    "fixed, band of full dynamics static",
    "fixed, band of registration plate dynamic",
    "sampled, band of full dynamics dynamic",
}
SKILL = {"fixed": (0.95, 0.90), "sampled": (0.88, 0.78)}  # median, worst


def judge(found, name, holds):
    """Fail where a line does not hold, or holds though it is listed as open; on fewer than MANY robots it may."""
    if name in OPEN and not holds:
        pytest.xfail(f"{name}: docs/limits.md")
    assert holds and (name not in OPEN or len(found.seeds) < MANY), name


@pytest.fixture(scope="module", params=["fixed", "sampled"])
def robots(request, tmp_path_factory):
    """Scores of thirty arms, ten where the others were not run."""
    overrides = SAMPLED if request.param == "sampled" else ()
    return request.param, kept_series(request.param, tmp_path_factory.mktemp, overrides, "humanoids2024")


@pytest.mark.parametrize("key", BANDS, ids=lambda key: "-".join((key.model, key.base, key.encoder, key.trials)))
def test_each_row_lies_in_its_band(robots, key, claim):
    arms, found = robots
    for name, quantity, (median, worst) in zip((MM, DEG), ("ladder", "orientation"), BANDS[key], strict=True):
        error = found.figures(key, name)
        claim(f"{quantity}/{arms}/{key.model}/{key.base}/{key.encoder}/{key.trials}", error)
        if arms == "sampled" and key.model == "full":
            median, worst = SPREAD * median, SPREAD * worst
        if arms == "fixed" or key.model == "full":
            judge(
                found,
                f"{arms}, {quantity} of {key.model} {key.base} {key.encoder} {key.trials}",
                np.median(error) <= median and error.max() <= worst,
            )


def test_the_delivered_row_removes_most_of_what_can_be(robots, claim):
    arms, found = robots
    skill = found.figures(Key("full"), "skill")
    claim(f"skill/{arms}/full/plate", skill)
    assert np.median(skill) >= SKILL[arms][0]
    assert skill.min() >= SKILL[arms][1]


def test_intervals_hold_the_truth(robots, claim):
    arms, found = robots
    share = found.coverage()
    claim(f"coverage/{arms}/every model", share)
    assert np.median(share) >= 0.90


def test_errors_of_the_delivered_parameters_are_as_their_covariance_has_them(robots, claim):
    arms, found = robots
    nees = found.nees("full")
    claim(f"nees/{arms}/full", nees)
    judge(found, f"{arms}, errors of parameters", nees.max() <= 2.0)


@pytest.mark.parametrize("key", INSIDE, ids=lambda key: "-".join((key.model, key.base, key.trials)))
def test_the_band_on_the_hand_holds_the_share_it_promises(robots, key, claim):
    arms, found = robots
    share = found.figures(key, "inside_95")
    claim(f"band/{arms}/{key.model}/{key.base}/{key.trials}", share)
    holds = INSIDE[key][0] <= round(share.mean(), 9) <= INSIDE[key][1]
    judge(found, f"{arms}, band of {key.model} {key.base} {key.trials}", holds)


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
    judge(found, f"{arms}, {axis}", r2.min() >= least)
