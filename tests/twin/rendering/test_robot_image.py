"""A picture of the twin exists on any machine, and shows what it should."""

import os
import subprocess
import sys
from dataclasses import replace

import matplotlib.image
import mujoco
import numpy as np
import pytest

import scenarios
from twin.rendering import picture
from twin.rendering.raycaster import View, render

SIZE = (240, 190)
BALL = """<mujoco><worldbody>
  <geom type="plane" size="9 9 1"/>
  <geom type="sphere" pos="0 0 1" size="0.2" rgba="1 0 0 1"/>
</worldbody></mujoco>"""


@pytest.fixture(scope="module")
def twin():
    return scenarios.load("humanoids2024").twin


def colours(path):
    """Pixels (height, width, 3) as 0..1."""
    return matplotlib.image.imread(path)[..., :3]


def reds(image, purity=2.5):
    return (image[..., 0] > purity * image[..., 1]) & (image[..., 0] > 0.15)


def test_the_picture_shows_plate_markers_and_payload_and_is_the_same_every_time(twin, tmp_path):
    first, second, bare = (tmp_path / "figures" / f"{n}.png" for n in ("first", "second", "bare"))
    picture(twin, 4, first, SIZE)
    picture(twin, 4, second, SIZE)
    picture(replace(twin, payload=replace(twin.payload, mass=0.0)), 4, bare, SIZE)
    assert first.read_bytes() == second.read_bytes()
    image = colours(first)
    assert image.shape == (190, 240, 3)
    assert reds(image).sum() > 20
    assert np.all(image[0, 0] > 0.95), "the background is light"
    box = np.abs(image - colours(bare)).max(axis=2) > 0.1
    assert 100 < box.sum() < 0.1 * box.size, "the payload is all that differs"


def test_the_picture_is_small(twin, tmp_path):
    picture(twin, 4, tmp_path / "twin.png", (450, 350))
    assert (tmp_path / "twin.png").stat().st_size < 60e3


def test_no_graphics_driver_is_asked_for(tmp_path):
    script = f"""
import sys
from pathlib import Path
import scenarios
from twin.rendering import picture
picture(scenarios.load("humanoids2024").twin, 4, Path({str(tmp_path / "twin.png")!r}), (60, 50))
print([name for name in sys.modules if name.startswith("OpenGL.")])
"""
    environment = {k: v for k, v in os.environ.items() if k != "DISPLAY"} | {"MUJOCO_GL": "disable"}
    done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "[]\n", "")
    assert (tmp_path / "twin.png").is_file()


@pytest.fixture(scope="module")
def ball():
    model = mujoco.MjModel.from_xml_string(BALL)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return model, data


def seen_from(side, lamp):
    """A view along the lab's -z (`above`) or +y (`front`), 90 deg high, from 2 m away from the ball."""
    T = np.eye(4)
    T[:3, 3] = [0.0, 0.0, 3.0]
    if side == "front":
        T[:3, :3], T[:3, 3] = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]]), [0.0, -2.0, 1.0]
    return View(T, np.pi / 2, np.array(lamp), (201, 201))


def test_a_ball_is_as_large_as_the_pinhole_says(ball):
    red = reds(render(*ball, seen_from("front", [0.0, -2.0, 5.0])) / 255.0, purity=1.5)
    radius = 100.5 * np.tan(np.arcsin(0.2 / 2.0))
    assert red.sum() == pytest.approx(np.pi * radius**2, rel=0.03)
    rows, columns = np.nonzero(red)
    np.testing.assert_allclose([rows.mean(), columns.mean()], 100.0, atol=0.5)


def test_a_shadow_falls_away_from_the_lamp(ball):
    image = render(*ball, seen_from("above", [-2.0, 0.0, 3.0])).astype(float).mean(axis=2)
    east, west = image[100, 135], image[100, 65]
    assert east < 0.8 * west
