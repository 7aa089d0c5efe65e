"""A marker body of the base whose place was measured: it tells apart what postures of a base at rest show together."""

from dataclasses import replace

import numpy as np
import pytest

import mjcf
from calibration import pipeline
from calibration.context import Context
from calibration.numerics.lie import from_vector, to_vector
from calibration.robot.laboratory import Laboratory
from calibration.stages.frames.base_stage import locate_base, with_base_frame
from calibration.stages.geometry.stage import calibrate_geometry
from calibration.stages.stage import Stage, StageInput, StageResult
from calibration.stages.suspension.weighing import declared_place
from tests.doubles import rigid_robot, spinning_base

ROBOT = rigid_robot.defects(5)
LAB = Laboratory(mjcf.urdf(), rigid_robot.described())
SIGMA = np.array([2e-4, 2e-4, 2e-3, 2e-3, 2e-3, 1e-3])
OFF = SIGMA * [1.0, -1.0, 0.5, -0.5, 0.5, 1.0]  # by which it was measured wrong
MEASURED = LAB.with_base_body(ROBOT.base + OFF, SIGMA)


@pytest.fixture(scope="module")
def found():
    """The base's frame of either fit, (6,) off from the truth, sigma, status; the placements of the first joint."""
    q = rigid_robot.near_postures(np.random.default_rng(2), 40)
    seen = rigid_robot.postures(ROBOT, q, 1e-4)
    models = [calibrate_geometry(lab.chain, lab.description, seen, judged=False)[0] for lab in (LAB, MEASURED)]
    return [[p for p in model.parameters if p.name.startswith("frame.base.base")] for model in models], models


def test_postures_alone_show_it_together_with_the_first_joint(found):
    (alone, measured), models = found
    assert {p.status for p in alone} == {"combined"} and {p.status for p in measured} == {"estimated"}
    assert [model.rank for model in models] == [36, 42]


def test_it_stays_where_it_was_measured(found):
    (alone, measured), _ = found
    off = np.array([p.value for p in measured]) - ROBOT.base
    sigma, before = (np.array([p.sigma for p in own]) for own in (measured, alone))
    assert (sigma <= SIGMA).all() and (sigma[:2] < 0.1 * before[:2]).all()
    assert (np.abs(off) < 3.0 * sigma).all()


def test_the_hand_is_where_it_is_without(found):
    """A measured frame changes how errors are shared, not what postures show."""
    _, (alone, measured) = found
    shared = {c.name: c for c in alone.combinations}
    values = {p.name: p.value for p in measured.parameters}
    names = [p.name for p in alone.parameters]
    for c in shared.values():
        value = float(c.coefficients @ np.array([values[name] for name in names]))
        assert abs(value - c.value) < 4.0 * c.sigma


def test_no_other_body_moves():
    pairs = zip(LAB.description.bodies, MEASURED.description.bodies, strict=True)
    assert [after.name for before, after in pairs if before != after] == [LAB.description.base_body.name]
    np.testing.assert_allclose(MEASURED.T_base_B, from_vector(ROBOT.base + OFF), atol=1e-12)


def test_spins_and_a_drive_measure_it():
    model, _ = locate_base(LAB, replace(spinning_base.stations(*spinning_base.path()), ids=("round", "ahead")))
    data = with_base_frame(StageInput(LAB, models=(model,)))
    values, sigma = (np.array([getattr(p, of) for p in model.parameters]) for of in ("value", "sigma"))
    np.testing.assert_allclose(to_vector(data.lab.T_base_B), values, atol=1e-12)
    np.testing.assert_allclose(data.lab.description.tolerances.body(data.lab.description.base_body), sigma)
    assert with_base_frame(StageInput(LAB)).lab is LAB


def test_geometry_and_what_follows_have_it_there(estimate, monkeypatch):
    spun, _ = locate_base(LAB, replace(spinning_base.stations(*spinning_base.path()), ids=("round", "ahead")))
    given: list[StageInput] = []
    stage = Stage("geometry", lambda data: given.append(data) or StageResult(), lacks=lambda data: "")
    monkeypatch.setattr(pipeline, "GEOMETRY", stage)
    after = pipeline._after(Context(StageInput(LAB, models=(spun,)), estimate), stage).data
    for lab in (given[0].lab, after.lab):
        np.testing.assert_allclose(lab.T_base_B[:2, 3], spinning_base.TRUE[:2], atol=1e-4)


def test_where_a_plate_is_under_the_base_is_known_to_both_places():
    plate, body = (getattr(LAB.description.tolerances, f"{of}_translation") for of in ("plate", "body"))
    np.testing.assert_allclose(declared_place(LAB.description), np.hypot(plate, body))
    np.testing.assert_allclose(declared_place(MEASURED.description), np.hypot(plate, 2e-4))
