"""Which marker bodies are the base and the hand."""

from calibration.errors import NotEnoughData
from calibration.schema import Body, Description

BASE, HAND = "base", "gripper"


def base_body(description: Description) -> Body:
    """The marker body on the base frame."""
    return _body(description, BASE, description.base_frame)


def hand_body(description: Description) -> Body:
    """The marker body at the hand, whose frame is the pose predicted and scored."""
    return _body(description, HAND, description.tool_frame)


def _body(description: Description, name: str, link: str) -> Body:
    found = description.body(name) or next((b for b in description.bodies if b.link == link), None)
    if found is None:
        known = [b.name for b in description.bodies]
        raise NotEnoughData(f"dataset.json has no marker body {name!r} and none on {link!r}; bodies: {known}")
    return found
