"""A 3D view shows what was recorded and predicted, in one file."""

import base64
import re

import numpy as np
import pytest

pytest.importorskip("viser", reason="the extra `view` is not installed")

import msgspec
import zstandard

import calibration
from scenarios import load, run
from scenarios.files.errors import ScenarioError
from scenarios.view.moment import moments
from scenarios.view.page import write
from scenarios.view.shapes import joined, meshes, rigid_groups

URDF = """<robot name="r">
<link name="base"><collision>
<origin xyz="0 0 1" rpy="0 1.5707963 0"/><geometry><box size="2 4 6"/></geometry></collision>
</link>
<link name="hand"><visual><geometry><sphere radius="0.5"/></geometry></visual>
<collision><geometry><box size="9 9 9"/></geometry></collision></link>
<link name="bare"><visual><geometry><mesh filename="missing.stl"/></geometry></visual></link></robot>"""


def test_a_link_is_shown_by_its_primitives():
    shapes = meshes(URDF)
    np.testing.assert_allclose(shapes["base"].bounds, [[-3, -2, 0], [3, 2, 2]], atol=1e-6)
    np.testing.assert_allclose(shapes["hand"].bounds, [[-0.5] * 3, [0.5] * 3], atol=1e-6)
    assert set(shapes) == {"base", "hand"}


def test_links_that_move_together_are_one():
    still, moving = np.tile(np.eye(4), (3, 1, 1)), np.tile(np.eye(4), (3, 1, 1))
    moving[:, 0, 3] = [0.0, 0.1, 0.2]
    shifted = moving @ np.array([[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    assert rigid_groups({"a": still, "b": moving, "c": shifted}) == [["a"], ["b", "c"]]
    whole = joined(meshes(URDF), {"base": np.eye(4), "hand": shifted[0]})
    np.testing.assert_allclose(whole.bounds, [[-3, -2, -0.5], [5.5, 2, 2]], atol=1e-6)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("view") / "short"
    run(load("short"), out=out, quick=True)
    return out


@pytest.mark.slow
def test_ghosts_are_magnified_errors_of_what_was_measured(folder):
    dataset = calibration.load(folder / "dataset")
    one, ten = (moments(folder, dataset, None, ("base_footprint", "gripper_link"), m) for m in (1.0, 10.0))
    np.testing.assert_allclose(one.links["gripper_link"][:, :3, 3], one.hand[:, :3, 3], atol=0.3)
    for model, T in one.ghosts.items():
        error, larger = (T.ghosts[model][:, :3, 3] - T.hand[:, :3, 3] for T in (one, ten))
        np.testing.assert_allclose(np.linalg.norm(larger, axis=1), 10 * np.linalg.norm(error, axis=1), rtol=1e-6)
    assert 5e-3 < np.linalg.norm(error, axis=1).mean() or set(one.ghosts) > {"nominal"}


@pytest.mark.slow
def test_one_file_has_robot_markers_force_ghosts_and_time(folder):
    page = folder / "view.html"
    trial = write(folder, None, page, 20.0)
    text = page.read_text(encoding="utf-8")
    data = base64.b64decode(re.search(r'__VISER_EMBED_DATA__="([^"]+)"', text)[1])
    inner = zstandard.ZstdDecompressor().decompressobj().decompress(data[8:])
    scene = msgspec.msgpack.decode(inner[8 : 8 + int.from_bytes(inner[:8], "little")], strict=False)
    names = {m.get("name", "") for _, m in scene["messages"]}
    assert scene["durationSeconds"] > 5.0 and page.stat().st_size < 5e6
    assert {"/predicted/nominal", "/residual/nominal", "/plate_force", "/markers/0"} <= names
    assert any(name.startswith("/robot/") for name in names)
    with pytest.raises(ScenarioError, match=trial):
        write(folder, "nope", page, 1.0)
