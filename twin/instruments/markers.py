"""Marker clusters on their links, as mounted, and markers that come loose."""

from dataclasses import dataclass

import numpy as np

from twin.defects.defect import Defect
from twin.errors import UnknownElement
from twin.transforms import exp6
from twin.truth import Parameter, twist_parameters


@dataclass(frozen=True)
class LooseMarker:
    """A marker that hangs by its play.

    Attributes:
        name: The marker.
        sag: a [m].
        since: t_0 [s from the campaign's start].
    """

    name: str
    sag: float
    since: float

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
