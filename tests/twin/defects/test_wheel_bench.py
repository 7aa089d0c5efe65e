"""One wheel under a load that moves up and down only, against its closed form.

M x'' = -k (x - y) - c (x' - y') - M g,     m y'' = k (x - y) + c (x' - y') - kn y - bn y' - m g
"""

import mujoco
import numpy as np
import pytest
from scipy.linalg import expm

from twin.defects.wheels import Bushing, Contact, Wheel
from twin.defects.wheels.contact import ContactTooStiff
from twin.simulation import build

M, m, G = 12.0, 0.14, 9.81
BENCH = f"""
<mujoco>
  <worldbody>
    <body name="plate"><site name="plate"/>
      <geom name="plate" type="box" pos="0 0 -0.05" size="1 1 0.05" mass="0" contype="1" conaffinity="0"/></body>
    <body name="base_footprint"><joint name="root.z" type="slide" axis="0 0 1"/>
      <inertial pos="0 0 0.2" mass="{M}" diaginertia="1 1 1"/>
      <body name="gripper_grasping_frame"/>
      <body name="caster" pos="0 0 0.05"><inertial pos="0 0 0" mass="{m}" diaginertia="1e-4 1e-4 1e-4"/>
        <geom name="caster_contact" type="sphere" size="0.05" mass="0" contype="0" conaffinity="1"/></body>
    </body>
  </worldbody>
</mujoco>"""


def stand(k, c, kn, bn, step, guide_friction=0.0):
    """A wheel on its bushing and contact; the model."""
    bushing = Bushing((1.4e4, 1.4e4, k), (60.0, 60.0, c), guide_friction=guide_friction)
    hub, foot = (0.0, 0.0, 0.05), (0.0, 0.0, 0.0)
    wheel = Wheel("caster", "caster", "caster_contact", hub, foot, bushing, Contact(kn, bn, 0.25))
    return build(mujoco.MjSpec.from_string(BENCH), [wheel], timestep=step).model


def heights(model, x, y, duration):
    """Of base and wheel (n, 2) from the unloaded height, released at x, y [m]."""
    data, found = mujoco.MjData(model), []
    base, wheel = model.joint("root.z").qposadr[0], model.joint("caster.z").qposadr[0]
    data.qpos[[base, wheel]] = x, y - x
    for _ in range(round(duration / model.opt.timestep)):
        found.append((data.qpos[base], data.qpos[base] + data.qpos[wheel]))
        mujoco.mj_step(model, data)
    return np.array(found)


def closed_form(k, c, kn, bn):
    """A (4, 4) of (x, y, x', y')."""
    K, C = np.array([[k, -k], [-k, k + kn]]), np.array([[c, -c], [-c, c + bn]])
    return np.block([[np.zeros((2, 2)), np.eye(2)], [-np.diag([1 / M, 1 / m]) @ K, -np.diag([1 / M, 1 / m]) @ C]])


CASES = pytest.mark.parametrize(
    ("k", "c", "kn", "bn"),
    [(1.7e5, 2500.0, 8e5, 200.0), (1.7e5, 300.0, 2e5, 100.0), (5e4, 300.0, 1.6e6, 200.0)],
    ids=["default", "soft contact", "stiff contact"],
)


@CASES
def test_a_wheel_sags_by_its_springs_in_series(k, c, kn, bn):
    sag = np.array([-M * G / k - (M + m) * G / kn, -(M + m) * G / kn])
    np.testing.assert_allclose(heights(stand(k, c, kn, bn, 1e-3), 0.0, 0.0, 3.0)[-1], sag, rtol=1e-3)


@pytest.mark.parametrize("step", [1e-3, 2e-4])
@pytest.mark.parametrize(("k", "kn"), [(1.7e5, 8e5), (1.7e5, 2e5), (5e4, 1.6e6)])
def test_a_wheel_swings_and_decays_as_its_closed_form(k, kn, step):
    c, bn = 300.0, 100.0
    poles = np.linalg.eigvals(closed_form(k, c, kn, bn))
    slow = poles[poles.imag > 0.0]
    slow = slow[np.argmin(np.abs(slow))]
    sag = np.array([-M * G / k - (M + m) * G / kn, -(M + m) * G / kn])
    x = (
        heights(stand(k, c, kn, bn, step), *(sag + 5e-5 * np.array([1.0, k / (k + kn)])), 3.0 / -slow.real)[:, 0]
        - sag[0]
    )
    x = x[round(0.15 * len(x)) :]  # the wheel's own swing is over
    (a, b), *_ = np.linalg.lstsq(np.stack([x[1:-1], x[:-2]], axis=1), x[2:], rcond=None)
    found = np.log(np.roots([1.0, -a, -b]).astype(complex)[0]) / step
    print("pole [1/s]", found, slow)
    assert abs(found.imag) == pytest.approx(slow.imag, rel=0.01)
    assert found.real == pytest.approx(slow.real, rel=0.02)


@pytest.mark.parametrize(("step", "within"), [(1e-3, 0.06), (1e-4, 0.006)])
def test_a_well_damped_wheel_comes_to_its_closed_form_with_the_step(step, within):
    """Rms over rms of a release: 2500 N.s/m on 0.14 kg are followed late at 1 ms, in proportion to the step."""
    k, c, kn, bn = 1.7e5, 2500.0, 8e5, 200.0
    sag = np.array([-M * G / k - (M + m) * G / kn, -(M + m) * G / kn])
    start = 5e-5 * np.array([1.0, k / (k + kn)])
    x = heights(stand(k, c, kn, bn, step), *(sag + start), 0.05)[:, 0] - sag[0]
    A = expm(closed_form(k, c, kn, bn) * step)
    true, state = [], np.array([*start, 0.0, 0.0])
    for _ in x:
        true.append(state[0])
        state = A @ state
    error = np.linalg.norm(x - true) / np.linalg.norm(true)
    print("error", error)
    assert error < within


@pytest.mark.parametrize(("kn", "bears"), [(2e6, True), (3e6, False)])
def test_a_contact_on_which_the_light_wheel_would_hop_is_refused(kn, bears):
    if bears:
        assert np.ptp(heights(stand(1.7e5, 300.0, kn, 200.0, 1e-3), 0.0, 0.0, 1.0)[-100:], axis=0).max() < 1e-6
    else:
        with pytest.raises(ContactTooStiff, match="contact stiffness 3e.06 N/m of 'caster' makes the wheel hop"):
            stand(1.7e5, 300.0, kn, 200.0, 1e-3)


def test_a_guide_that_rubs_holds_until_twice_its_friction_is_taken_off():
    """(F + M g - f) / k when pressed by F, the contact alone while less than 2 f is taken off, (M g + f) / k beyond."""
    k, kn, f = 1.7e5, 8e5, 10.0
    model = stand(k, 2500.0, kn, 200.0, 1e-3, f)
    data, base = mujoco.MjData(model), model.body("base_footprint").id
    guide = []
    _pressed(model, data, base, 0.0, 2.0)
    for load in (4.0 * f, 3.0 * f, 0.0):
        _pressed(model, data, base, load, 3.0)
        guide.append(data.joint("caster.z").qpos[0])
        assert data.joint("root.z").qpos[0] + guide[-1] == pytest.approx(-(load + (M + m) * G) / kn, rel=1e-2)
    np.testing.assert_allclose(guide, np.array([3.0 * f + M * G, 3.0 * f + M * G, f + M * G]) / k, rtol=2e-3)


def test_a_guide_at_rest_does_not_creep():
    model = stand(1.7e5, 2500.0, 8e5, 200.0, 1e-3, 10.0)
    data, base = mujoco.MjData(model), model.body("base_footprint").id
    _pressed(model, data, base, 8.0, 2.0)
    held = data.joint("caster.z").qpos[0]
    _pressed(model, data, base, 8.0, 20.0)
    assert abs(data.joint("caster.z").qpos[0] - held) < 1e-8


def _pressed(model, data, base, load, duration):
    """Press the base down with a load [N], put on over the first half of the time: nothing bounces past its rest."""
    n, before = round(duration / model.opt.timestep), -data.xfrc_applied[base, 2]
    for share in np.minimum(2.0 * np.arange(1, n + 1) / n, 1.0):
        data.xfrc_applied[base, 2] = -(before + share * (load - before))
        mujoco.mj_step(model, data)
