from dataclasses import replace

import mujoco
import numpy as np
import pytest

import mjcf
from scenarios import load
from tests.doubles.grounds import GROUNDS
from twin import build, load_test
from twin.base_tests import LoadTestFailed, gravity_stiffness, release_test
from twin.campaign import sample
from twin.defects.wheels import spatial_stiffness
from twin.defects.wheels.bushing import BushingTooStiff, TorsionTooStiff


def standing(nominal, *settings, seed=0):
    """A twin of wheels and nothing else, and its wheels."""
    config = load("humanoids2024", list(settings)).twin
    robot = sample(config, seed)
    wheels = [d for d in robot.defects if type(d).__name__ in ("Wheel", "Anchored")]
    return build(mjcf.spec(), wheels, timestep=config.timestep), robot.wheels


def error(found, true):
    """Largest departure of an element, relative to the geometric mean of its diagonal pair; axes that give."""
    give = np.isfinite(np.diag(true))
    np.testing.assert_array_equal(np.isfinite(np.diag(found)), give)
    found, true = found[np.ix_(give, give)], true[np.ix_(give, give)]
    q = np.sqrt(np.diag(true))
    return np.abs((found - true) / np.outer(q, q)).max()


def test_stiffness_of_the_base_is_the_sum_over_wheels(lab):
    wheels = lab.robot.wheels
    p = np.array([w.contact for w in wheels])
    K, C = spatial_stiffness(wheels)
    k = np.array([w.bushing.stiffness for w in wheels])
    kc = np.array([w.footing.stiffness for w in wheels])
    kz = k[:, 2] * kc / (k[:, 2] + kc)
    np.testing.assert_allclose(K[2, 2], sum(kz))
    np.testing.assert_allclose(K[3, 3], np.dot(kz, p[:, 1] ** 2))
    np.testing.assert_allclose(K[5, 5], np.dot(k[:, 0], p[:, 1] ** 2) + np.dot(k[:, 1], p[:, 0] ** 2))
    np.testing.assert_allclose(K, K.T)
    h = 1e-3  # heave at h rad/s: the imaginary part of the dynamic stiffness is damping times h
    series = [
        1 / (1 / (w.bushing.stiffness[2] + 1j * h * w.bushing.damping[2]) + 1 / (kc_i + 1j * h * w.footing.damping))
        for w, kc_i in zip(wheels, kc, strict=True)
    ]
    np.testing.assert_allclose(C[2, 2], sum(series).imag / h, rtol=1e-9)


@pytest.mark.parametrize("ground", ["contact", "anchored", pytest.param("turning", marks=pytest.mark.slow)])
def test_load_and_release_find_the_stated_springs_and_dampers(nominal, ground, claim):
    twin, wheels = standing(nominal, *GROUNDS[ground])
    K, C = spatial_stiffness(wheels)
    found = load_test(twin)
    errors = error(found.K, K), error(release_test(twin), C)
    stated(claim, f"default, {ground}", errors)
    assert errors[0] < 1e-3
    assert errors[1] < 0.05
    gravity = gravity_stiffness(twin, wheels)
    q = np.sqrt(np.diag(K))
    assert np.abs((found.K_gravity - gravity) / np.outer(q, q)).max() < 1e-3
    np.testing.assert_allclose(np.diag(found.K_gravity)[3:5], np.diag(gravity)[3:5], rtol=0.01)


def stated(claim, base, errors):
    for of, value in zip(("stiffness", "damping"), errors, strict=True):
        claim(f"physics/base/{of}/{base}", value)


def random_base(seed):
    """Every value of every wheel type within a factor of two of the default's; friction no less, for none may slip."""
    rng, base, found = np.random.default_rng(seed), load("humanoids2024").twin.base, []
    for wheel in ("drive", "caster_front", "caster_back"):
        for field in ("stiffness", "damping", "contact_stiffness", "contact_damping", "friction"):
            value = np.array(getattr(getattr(base, wheel), field))
            least, most = 1.0 if field == "friction" else 0.5, 1.3 if field == "contact_damping" else 2.0
            drawn = value * np.exp(rng.uniform(np.log(least), np.log(most), value.shape))
            found.append(f"twin.base.{wheel}.{field}={drawn.tolist()}")
    return found


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_the_springs_and_dampers_of_random_bases_are_found(nominal, seed, claim):
    twin, wheels = standing(nominal, *random_base(seed))
    K, C = spatial_stiffness(wheels)
    errors = error(load_test(twin).K, K), error(release_test(twin), C)
    stated(claim, f"random bases#{seed}", errors)
    assert errors[0] < 1e-3
    assert errors[1] < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_the_springs_and_dampers_of_random_bases_whose_casters_turn_are_found(nominal, seed, claim):
    settings = [s for s in random_base(seed) if ".friction" not in s]
    twin, wheels = standing(nominal, *settings, *GROUNDS["turning"])
    K, C = spatial_stiffness(wheels)
    errors = error(load_test(twin).K, K), error(release_test(twin), C)
    stated(claim, f"random bases whose casters turn#{seed}", errors)
    assert errors[0] < 1e-2
    assert errors[1] < 0.05


def test_a_wheel_that_slips_under_the_test_is_reported(nominal):
    twin, _ = standing(nominal, "twin.base.caster_back.friction=0.005")
    with pytest.raises(LoadTestFailed, match="a wheel slips or lifts under"):
        load_test(twin)


def test_a_caster_too_light_for_its_springs_is_refused(nominal):
    with pytest.raises(BushingTooStiff, match="stiffness 120000 N/m .*'caster_back"):
        standing(nominal, "twin.base.caster_back.stiffness=[120000.0, 25000.0, 170000.0]")


TORSION = {
    "z": ["twin.base.drive.torsion=[0.0, 0.0, 400.0]"],
    "xyz": GROUNDS["twisting"],
}


@pytest.mark.parametrize(
    ("axes", "ground"),
    [*(pytest.param(axes, "contact", marks=pytest.mark.slow) for axes in TORSION), ("xyz", "anchored")],
)
def test_torsion_is_carried_to_the_floor(nominal, axes, ground):
    twin, wheels = standing(nominal, *TORSION[axes], f"twin.base.wheels={ground}")
    K, C = spatial_stiffness(wheels)
    found = load_test(twin).K
    assert error(found, K) < 1e-3
    assert error(release_test(twin), C) < 0.05
    plain, _ = spatial_stiffness([replace(w, bushing=replace(w.bushing, torsion=(0.0, 0.0, 0.0))) for w in wheels])
    assert error(found, plain) > 0.2  # what a contact that cannot transmit it would leave


def test_a_point_contact_carries_no_torsion(nominal):
    twin, wheels = standing(nominal, *TORSION["z"])
    for wheel in wheels:
        twin.model.geom(wheel.contact_geom).condim[0] = 3
    plain, _ = spatial_stiffness([replace(w, bushing=replace(w.bushing, torsion=(0.0, 0.0, 0.0))) for w in wheels])
    assert error(load_test(twin).K, plain) < 1e-3


def test_torsional_damping_that_a_light_wheel_cannot_follow_is_refused(nominal):
    with pytest.raises(TorsionTooStiff, match="torsional damping 5 .*anchored"):
        standing(nominal, *TORSION["xyz"], "twin.base.caster_back.torsion_damping=[5.0, 5.0, 5.0]")


def test_torsion_that_a_light_wheel_cannot_follow_is_refused(nominal):
    with pytest.raises(
        TorsionTooStiff, match="torsional stiffness 1200 .*'caster_back.*at most 1.1e[+]03 N.m/rad, .*anchored"
    ):
        standing(nominal, "twin.base.caster_back.torsion=[0.0, 0.0, 1200.0]")


@pytest.mark.parametrize("stiffness", [2e5, pytest.param(8e5, marks=pytest.mark.slow), 3e6])
def test_soft_contacts_alone_carry_heave_and_tilt(nominal, stiffness):
    kinds = ("drive", "caster_front", "caster_back")
    contacts = [f"twin.base.{w}.contact_stiffness={stiffness}" for w in kinds]
    twin, wheels = standing(nominal, "twin.base.wheels=rigid", *contacts)
    K, C = spatial_stiffness(wheels)
    assert error(load_test(twin).K, K) < 0.01
    if stiffness == 8e5:
        np.testing.assert_allclose(np.diag(release_test(twin))[2:5], np.diag(C)[2:5], rtol=0.05)


def test_weight_takes_its_height_off_the_tilt_stiffness_of_an_anchored_base(nominal):
    """m g h, as any inverted pendulum."""
    twin, wheels = standing(nominal, *GROUNDS["anchored"])
    data = mujoco.MjData(twin.model)
    mujoco.mj_forward(twin.model, data)
    base = twin.model.body("base_footprint").id
    h = data.subtree_com[base, 2] - data.xpos[base, 2]
    expected = -9.81 * twin.model.body_subtreemass[base] * h
    np.testing.assert_allclose(np.diag(gravity_stiffness(twin, wheels))[3:5], expected, rtol=1e-3)


@pytest.mark.parametrize("setting, words", [
    ("twin.base.caster_front.guide_friction=3.3", "the guide 'caster_front_right.z' rubs with 3.3 N"),
    ("twin.base.drive.friction=0.0", r"a wheel slips or lifts under .* 11.5% are of the last 0.1 s"),
])  # fmt: skip
def test_a_base_that_a_small_load_does_not_tell_is_refused(nominal, setting, words):
    others = [f"twin.base.{w}.friction=0.0" for w in ("caster_front", "caster_back")] * setting.endswith("=0.0")
    twin, _ = standing(nominal, setting, *others)
    with pytest.raises(LoadTestFailed, match=words):
        load_test(twin)


def test_numbers_that_run_away_on_the_bench_are_reported(nominal):
    twin, _ = standing(nominal)
    twin.model.body_mass[twin.model.body("torso_lift_link").id] = np.nan
    with pytest.raises(LoadTestFailed, match="not a number"):
        load_test(twin)


def test_the_bare_nominal_robot_can_be_tested():
    K, K_gravity = load_test(build(mjcf.spec(), ()))
    assert np.isinf(np.diag(K)[[0, 1, 5]]).all()
    assert (np.diag(K)[2:5] > 1e3).all()
    assert K_gravity.shape == (6, 6)
