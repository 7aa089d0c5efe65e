"""Pictures of a twin and clips of its trials."""

from twin.rendering.renderer import NoGraphics
from twin.rendering.robot_image import picture
from twin.rendering.trial_video import ClipOptions, NothingToShow, clip

__all__ = [
    "ClipOptions",
    "NoGraphics",
    "NothingToShow",
    "clip",
    "picture",
]
