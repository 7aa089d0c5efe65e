"""Marker clusters on their links, as mounted, and markers that come loose.

placement   T_link_body = exp6(xi)              nominally the identity: a body's frame is its link's frame
loose       y = p - a (0, 0, 1)                 hangs by its slack a, from t_0 on
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field
from pydantic.dataclasses import dataclass as validated
from scipy.spatial.transform import Rotation

from twin.defects.defect import Defect
from twin.errors import UnknownElement
from twin.fields.names import BASE, HAND, LinkName
from twin.fields.values import BY_NAME, STRICT, NonNegative, Vector3
from twin.transforms import exp6
from twin.truth import Parameter, twist_parameters


@validated(frozen=True, config=STRICT)
class LooseMarker:
    """A marker that hangs by its slack, until it is mounted again.

    Attributes:
        name: The marker.
        sag: a [m].
        since: t_0 [s from the campaign's start].
    """

    name: str
    sag: NonNegative
    since: NonNegative = 0.0

    def moved(self, t: np.ndarray, markers: tuple[str, ...], positions: np.ndarray) -> np.ndarray:
        """Positions (n, n_markers, 3) [m, lab] at times t (n,) [s from the campaign's start] with this marker loose.

        Raises:
            UnknownElement: There is no such marker.
        """
        if self.name not in markers:
            raise UnknownElement("marker", self.name, markers)
        out = positions.copy()
        out[:, markers.index(self.name), 2] -= np.where(t >= self.since, self.sag, 0.0)
        return out

    def parameters(self) -> tuple[Parameter, ...]:
        """How far it hangs, and from when on."""
        name = f"loosened.{self.name}"
        return Parameter(f"{name}.sag", "m", self.sag), Parameter(f"{name}.since", "s", self.since)


@dataclass(frozen=True)
class Cluster(Defect):
    """A marker cluster on its link.

    Attributes:
        name: Name of the marker body.
        link: The link that carries it.
        frames: The contract's names of both frames, `base.base` or `tool.hand`.
        xi: Placement error of the cluster, twist (6,) [m, rad].
        marker_names: Names of its markers.
        nominal: Nominal marker positions in the body's frame (n, 3) [m].
        shift: Error of each marker within the cluster (n, 3) [m].
    """

    name: str
    link: str
    frames: str
    xi: np.ndarray
    marker_names: tuple[str, ...]
    nominal: np.ndarray
    shift: np.ndarray

    @property
    def T_link_body(self) -> np.ndarray:
        """True pose of the body's frame on its link (4, 4)."""
        return exp6(self.xi)

    def parameters(self) -> tuple[Parameter, ...]:
        """Translation and rotation vector of T_link_body, and each marker's true position in the body's frame."""
        T = self.T_link_body
        values = np.concatenate([T[:3, 3], self.xi[3:]])
        markers = zip(self.marker_names, self.nominal + self.shift, strict=True)
        return (
            *twist_parameters(f"frame.{self.frames}", values),
            *(Parameter(f"marker.{m}.{a}", "m", float(v)) for m, p in markers for a, v in zip("xyz", p, strict=True)),
        )


@validated(frozen=True, config=STRICT)
class MarkerBody:
    """A marker cluster: where it should be, and how far off it is mounted.

    Attributes:
        link: The link that carries it; the body's frame is nominally the link's.
        markers: Nominal position of each marker in that frame [m].
        translation: Standard deviation of the cluster's placement, per axis [m].
        rotation: Standard deviation of the cluster's orientation, per axis [rad].
        marker: Standard deviation of each marker within its cluster, per axis [m].
    """

    link: LinkName
    markers: Annotated[dict[str, Vector3], Field(min_length=1), BY_NAME]
    translation: NonNegative
    rotation: NonNegative
    marker: NonNegative

    def mounted(self, name: str, rng: np.random.Generator) -> Cluster:
        """The cluster as it is mounted on one robot."""
        nominal = np.array(list(self.markers.values()))
        placement = rng.normal(size=6) * np.repeat([self.translation, self.rotation], 3)
        scattered = nominal + rng.normal(size=nominal.shape) * self.marker
        frames = {BASE: f"base.{name}", HAND: "tool.hand"}.get(self.link, f"{self.link}.{name}")
        shift = _without_rigid_part(scattered, nominal) - nominal
        return Cluster(name, self.link, frames, placement, tuple(self.markers), nominal, shift)


def _without_rigid_part(points: np.ndarray, nominal: np.ndarray) -> np.ndarray:
    """Points (n, 3) moved onto `nominal` as one rigid body: a body's frame is where its nominal markers fit best.

    Markers of one nominal place, or a single one, define no rotation: these are only shifted.
    """
    p, q = points.mean(axis=0), nominal.mean(axis=0)
    if (nominal == nominal[0]).all():
        return points - p + q
    return Rotation.align_vectors(nominal - q, points - p)[0].apply(points - p) + q
