"""view.html: robot, markers, plate force and the hand as rows of the ladder predict it, over the time of a trial.

viser records a scene and its changes and embeds both in its own viewer: one file, opened without a server or a network.
"""

import io
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import trimesh
import viser
from scipy.spatial.transform import Rotation

import calibration
from calibration.numerics.lie import inverse
from calibration.prediction import NOMINAL
from scenarios.files.output_folder import one_file
from scenarios.view.moment import Moments, moments
from scenarios.view.shapes import joined, meshes, rigid_groups

Progress = Callable[[str, float], None]

_ROBOT, _MARKER, _FORCE = (205, 208, 214), (214, 40, 57), (20, 96, 190)
_NOMINAL, _CALIBRATED = (120, 120, 120), (26, 95, 168)
_RADIUS = 0.012  # [m] of a marker
_DOWN = 1e-9  # [-] nearer than this to straight down an arrow is turned about x


@dataclass(frozen=True)
class Node:
    """A node of the scene that moves: its handle, and what changes (n, ...) by name: position, wxyz, scale."""

    handle: viser.SceneNodeHandle
    changes: dict[str, np.ndarray]


def write(run: Path, trial: str | None, out: Path, magnify: float, progress: Progress | None = None) -> str:
    """Write the page of a held-out trial, the first that moves unless named; return its name.

    Raises:
        ScenarioError: The run is not evaluated, or has no such trial.
        InputError: A file cannot be read.
    """
    dataset = calibration.load(run / "dataset")
    shapes = meshes(dataset.urdf)
    found = moments(run, dataset, trial, tuple(shapes), magnify)
    with redirect_stdout(io.StringIO()):  # viser announces its server, which nobody is to visit
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
        try:
            page = _recorded(server, found, shapes, _title(found, magnify), progress)
        finally:
            server.stop()
    with one_file(out) as part:
        part.write_text(page, encoding="utf-8", newline="\n")
    return found.trial


def _title(found: Moments, magnify: float) -> str:
    hands = ", ".join(f"{'grey' if model == NOMINAL else 'blue'} {model}" for model in found.ghosts)
    return f"{found.trial}: motion of the base, errors x {magnify:g}; {hands}"


def _recorded(
    server: viser.ViserServer, found: Moments, shapes: dict[str, trimesh.Trimesh], title: str, progress: Progress | None
) -> str:
    """The page: the scene at the first moment, then its changes."""
    centre = next(iter(found.links.values()))[0, :3, 3] if found.links else found.hand[0, :3, 3]
    server.scene.set_up_direction("+z")
    server.initial_camera.position = tuple(centre + [0.9, -1.2, 1.1])
    server.initial_camera.look_at = tuple(centre + [0.2, 0.0, 0.6])
    server.scene.add_grid("/floor", width=4.0, height=4.0, cell_size=0.25, position=(*centre[:2], 0.0))
    server.scene.add_label("/title", title, position=tuple(centre + [0.0, 0.0, 1.45]))
    nodes = [*_robot(server, found, shapes), *_ghosts(server, found, shapes), *_markers(server, found)]
    nodes += _arrows(server, found)
    recording = server.get_scene_serializer()
    for k, dt in enumerate(np.diff(found.t, append=found.t[-1])):
        for node in nodes:
            for name, values in node.changes.items():
                setattr(node.handle, name, values[k])
        recording.insert_sleep(float(dt))
        if progress is not None:
            progress(found.trial, (k + 1) / len(found.t))
    return recording.as_html()


def _robot(server: viser.ViserServer, found: Moments, shapes: dict[str, trimesh.Trimesh]) -> list[Node]:
    nodes = []
    for group in rigid_groups(found.links):
        T = found.links[group[0]]
        mesh = joined(shapes, {link: inverse(T[0]) @ found.links[link][0] for link in group})
        nodes.append(
            _node(server.scene.add_mesh_simple(f"/robot/{group[0]}", mesh.vertices, mesh.faces, color=_ROBOT), T)
        )
    return nodes


def _ghosts(server: viser.ViserServer, found: Moments, shapes: dict[str, trimesh.Trimesh]) -> list[Node]:
    if not found.hand_links:
        return []
    hand = joined(shapes, found.hand_links)
    add = partial(server.scene.add_mesh_simple, vertices=hand.vertices, faces=hand.faces, opacity=0.55)
    return [_node(add(f"/predicted/{model}", color=_colour(model)), T) for model, T in found.ghosts.items()]


def _node(handle: viser.SceneNodeHandle, T: np.ndarray) -> Node:
    turned = Rotation.from_matrix(T[:, :3, :3]).as_quat(scalar_first=True)
    return Node(handle, {"position": T[:, :3, 3], "wxyz": turned})


def _colour(model: str) -> tuple[int, int, int]:
    return _NOMINAL if model == NOMINAL else _CALIBRATED


def _markers(server: viser.ViserServer, found: Moments) -> list[Node]:
    """A sphere each; a hidden marker is far below the floor."""
    places = np.nan_to_num(found.markers, nan=-100.0)
    return [
        Node(server.scene.add_icosphere(f"/markers/{k}", radius=_RADIUS, color=_MARKER), {"position": places[:, k]})
        for k in range(places.shape[1])
    ]


def _arrows(server: viser.ViserServer, found: Moments) -> list[Node]:
    """The plate's reaction, and each row's residual: from the measured hand to its ghost."""
    nodes = [
        _arrow(server, f"/residual/{model}", found.hand[:, :3, 3], T[:, :3, 3], _colour(model))
        for model, T in found.ghosts.items()
    ]
    if np.isfinite(found.force).any():
        force = np.nan_to_num(found.force)
        nodes.append(_arrow(server, "/plate_force", force[:, 0], force[:, 1], _FORCE))
    return nodes


def _arrow(
    server: viser.ViserServer, name: str, foot: np.ndarray, head: np.ndarray, colour: tuple[int, int, int]
) -> Node:
    """An arrow from foot (n, 3) to head (n, 3): one along z, 1 m long, turned and scaled."""
    add = partial(server.scene.add_arrows, shaft_radius=0.02, head_radius=0.05, head_length=0.12)
    handle = add(name, np.array([[[0, 0, 0], [0, 0, 1]]], np.float32), colour)
    along = head - foot
    length = np.maximum(np.linalg.norm(along, axis=1), 1e-4)
    z = along / length[:, None]
    turned = np.stack([1.0 + z[:, 2], -z[:, 1], z[:, 0], np.zeros(len(z))], axis=1)
    turned[z[:, 2] < _DOWN - 1.0] = [0.0, 1.0, 0.0, 0.0]
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    return Node(handle, {"position": foot, "wxyz": turned, "scale": length})
