"""Which marker body is the base's and which the hand's: by the links they are fixed on, whatever their names."""

from collections.abc import Sequence
from typing import Protocol, TypeVar


class OnLink(Protocol):
    """A body with a name and the link it is on."""

    @property
    def name(self) -> str:
        """Its name."""
        ...

    @property
    def link(self) -> str:
        """The link it is fixed on."""
        ...


B = TypeVar("B", bound=OnLink)


def body_on(bodies: Sequence[B], link: str, base: str = "") -> B | None:
    """The first body on a link; for a hand, the only one that is not on the link `base` where none is on its own."""
    found = next((b for b in bodies if b.link == link), None)
    others = [b for b in bodies if b.link != base]
    return others[0] if found is None and base and len(others) == 1 else found
