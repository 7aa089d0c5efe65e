"""Clips show the trial that was recorded, and tell where no driver can draw."""

import logging
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from PIL import Image

from twin.campaign import measure
from twin.motions import CALIBRATION_SWINGS, motion
from twin.rendering import ClipOptions, NoGraphics, NothingToShow, clip
from twin.rendering import renderer as graphics
from twin.rendering.raycaster import View
from twin.rendering.trial_video import magnified, projected, reaction
from twin.simulation import simulate

SMALL = ClipOptions(magnify=30.0, start=0.5, duration=0.6, rate=5.0, size=(120, 93), renderer="rays")


@pytest.fixture(scope="module")
def trial(lab, config):
    path = CALIBRATION_SWINGS["around_z"]
    swing = motion.swing("z", "calibration", "swing", path, 1.0, replace(config.campaign, rest=1.0))
    return measure(lab, swing, simulate(lab.twin, swing, lab.T_lab_base), 100.0)[1]


def test_a_clip_has_a_picture_every_so_often_and_they_differ(lab, trial, tmp_path):
    assert clip(lab, trial, tmp_path / "a.gif", SMALL) == 3
    gif = Image.open(tmp_path / "a.gif")
    assert (gif.format, gif.n_frames, gif.size, gif.info["duration"]) == ("GIF", 3, (120, 93), 200)
    frames = []
    for k in range(3):
        gif.seek(k)
        frames.append(np.asarray(gif.convert("RGB")).astype(int))
    assert np.abs(frames[2] - frames[0]).max() > 50


def test_a_still_is_a_png(lab, trial, tmp_path):
    assert clip(lab, trial, tmp_path / "a.part", replace(SMALL, duration=0.0)) == 1
    assert Image.open(tmp_path / "a.part").format == "PNG"


def test_time_outside_the_trial_is_reported(lab, trial, tmp_path):
    with pytest.raises(NothingToShow, match=r"lasts 3\.\d s; there is nothing from 99 s on"):
        clip(lab, trial, tmp_path / "a.gif", replace(SMALL, start=99.0))
    assert not list(tmp_path.iterdir())


def test_motion_is_magnified_about_the_start():
    twist = np.array([1e-3, 2e-3, 0.0, 0.0, 1e-3, 4e-3])
    start = pin.exp6(np.array([0.9, 0.5, 0.0, 0.0, 0.0, -1.6]))
    T = np.array([start.homogeneous, (start * pin.exp6(twist)).homogeneous])
    np.testing.assert_allclose(magnified(T, 1.0), T, atol=1e-12)
    large = magnified(T, 50.0)
    np.testing.assert_allclose(large[0], T[0], atol=1e-12)
    np.testing.assert_allclose(pin.log6(start.inverse() * pin.SE3(large[1])).vector, 50.0 * twist, atol=1e-9)


def test_the_arrow_starts_where_the_load_stands_and_points_against_it():
    force, at = np.array([10.0, -5.0, -700.0]), np.array([0.08, -0.03, 0.0])
    centre = np.array([0.9, 0.45, 0.0])
    foot, head = reaction(np.concatenate([force, np.cross(at, force)]), centre)
    np.testing.assert_allclose(foot, centre + at, atol=1e-12)
    np.testing.assert_allclose(head - foot, [-7e-3, 3.5e-3, 0.49], atol=1e-12)
    assert reaction(np.zeros(6), centre) is None


def test_what_is_drawn_over_a_picture_lies_where_the_pinhole_says():
    T = np.eye(4)
    T[:3, 3] = [0.0, 0.0, 3.0]
    view = View(T, np.pi / 2, np.zeros(3), (200, 100))
    np.testing.assert_allclose(projected(view, np.array([[0.0, 0.0, 0.0], [0.6, 0.3, 1.0]])), [[100, 50], [115, 42.5]])


def test_a_machine_without_a_driver_casts_rays_and_says_so(lab, trial, tmp_path, monkeypatch, caplog):
    def none(*_):
        raise NoGraphics("libEGL is missing")

    monkeypatch.setattr(graphics, "_open", none)
    with caplog.at_level(logging.WARNING):
        clip(lab, trial, tmp_path / "auto.png", replace(SMALL, duration=0.0, renderer="auto"))
    assert "no OpenGL without a screen here (libEGL is missing)" in caplog.text
    clip(lab, trial, tmp_path / "rays.png", replace(SMALL, duration=0.0))
    assert (tmp_path / "auto.png").read_bytes() == (tmp_path / "rays.png").read_bytes()
    with pytest.raises(NoGraphics, match="install EGL .* or cast rays"):
        clip(lab, trial, tmp_path / "egl.png", replace(SMALL, duration=0.0, renderer="egl"))
    assert not Path(tmp_path / "egl.png").exists()


def test_driver_and_rays_show_the_same_scene(lab, trial, tmp_path):
    pictures = []
    for renderer in ("egl", "rays"):
        try:
            clip(lab, trial, tmp_path / renderer, replace(SMALL, duration=0.0, renderer=renderer, size=(240, 187)))
        except NoGraphics as error:
            pytest.skip(str(error))
        pictures.append(np.asarray(Image.open(tmp_path / renderer).convert("RGB")).astype(float))
    blue = [(p[..., 2] > 1.6 * p[..., 0]) & (p[..., 2] > 120) for p in pictures]
    np.testing.assert_array_equal(blue[0], blue[1])
    dark = [(p.max(axis=2) < 60)[:120] for p in pictures]  # the robot's black parts, above the plate
    overlap = (dark[0] & dark[1]).sum() / (dark[0] | dark[1]).sum()
    assert overlap > 0.5
