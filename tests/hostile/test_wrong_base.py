"""Mistakes that only the base shows: its wheels, its plate, and a push, in a short campaign of the default robot."""

from dataclasses import replace

import numpy as np
import pytest

from calibration import calibrate, load
from calibration.numerics.lie import from_vector
from tests.hostile.rows.campaign import Campaign

pytestmark = pytest.mark.slow
PLATE, BASE = ("suspension",), ("suspension", "bundle")


def turned(c: Campaign) -> Campaign:
    """The plate lies 5 deg off about the vertical."""
    R = from_vector(np.array([0.0, 0.0, 0.0, 0.0, 0.0, np.radians(5.0)]))[:3, :3]
    return c.changed("calibration", lambda t, _: replace(t, plate_wrench=t.plate_wrench @ np.kron(np.eye(2), R)))


def reversed_fy(c: Campaign) -> Campaign:
    signs = np.array([1.0, -1.0, 1.0, 1.0, 1.0, 1.0])
    return c.changed("calibration", lambda t, _: replace(t, plate_wrench=signs * t.plate_wrench))


def off_the_plate(c: Campaign) -> Campaign:
    """The front right caster beside the plate, which misses a sixth of the weight there."""
    place = next(w["contact"] for w in c.listed["wheels"] if w["name"] == "caster_front_right")

    def of_trial(trial, _):
        early = trial.t_mocap < trial.t_mocap[0] + 1.0
        names = [m["name"] for b in c.listed["bodies"] if b["name"] == "base" for m in b["markers"]]
        own = np.array([m["xyz"] for b in c.listed["bodies"] if b["name"] == "base" for m in b["markers"]])
        seen = np.nanmean(trial.marker_position[early][:, [trial.marker.index(n) for n in names]], axis=0)
        U, _, Vt = np.linalg.svd((own - own.mean(0)).T @ (seen - seen.mean(0)))
        R = Vt.T @ np.diag([1.0, 1.0, np.linalg.det(Vt.T @ U.T)]) @ U.T
        plate = c.listed["plates"][0]
        arm = (R @ (np.array(place) - own.mean(0)) + seen.mean(0) - np.array(plate["centre"])) * [1.0, 1.0, 0.0]
        axes, w = np.array(plate["axes"]), trial.plate_wrench.copy()
        force = (w[:, 0, :3] @ axes.T) * [0.0, 0.0, 1.0 / 6.0]
        w[:, 0] -= np.hstack([force @ axes, np.cross(arm, force) @ axes])
        return replace(trial, plate_wrench=w)

    return c.changed("calibration", of_trial)


def pushed(c: Campaign) -> Campaign:
    """Somebody leans on the base in a swing: all markers 22 mm off from its middle on."""

    def of_trial(trial, name):
        late = trial.t_mocap > trial.t_mocap.mean()
        off = np.where(late[:, None, None] & (name == "around_x"), [0.02, 0.01, 0.0], 0.0)
        return replace(trial, marker_position=trial.marker_position + off)

    return c.changed("calibration", of_trial)


def misplaced(c: Campaign) -> Campaign:
    """The front right caster declared 30 mm further out."""

    def change(d: dict) -> None:
        wheel = next(w for w in d["wheels"] if w["name"] == "caster_front_right")
        for what in ("centre", "contact"):
            wheel[what][1] -= 0.03

    return c.redrawn(change)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    from scenarios.steps import run_steps

    out = tmp_path_factory.mktemp("base") / "run"
    run_steps.simulate(run_steps.load("humanoids2024", ["seed=3"]).quick(), out)
    return Campaign.of(load(out / "dataset"), 0.0)


@pytest.mark.parametrize(
    ("mistake", "stages", "says"),
    [
        (turned, PLATE, "plate rotated by"),
        (reversed_fy, PLATE, "Fy mirror"),
        (off_the_plate, PLATE, "as if caster_front_right stood off the plate"),
        (pushed, PLATE, "base moved during around_x by 22"),
        (misplaced, BASE, "caster_front_right stood"),
    ],
)
def test_what_is_wrong_with_the_base_is_named(campaign, mistake, stages, says, tmp_path):
    verdicts = calibrate(load(mistake(campaign).written(tmp_path / "data")), stages).verdicts
    assert says in " ".join(v.message for v in verdicts if v.verdict in ("warning", "refused"))
