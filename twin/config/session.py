"""What changes until a second session; SI units."""

from pydantic.dataclasses import dataclass

from twin.fields.values import STRICT, NonNegative


@dataclass(frozen=True, config=STRICT)
class Session:
    """What changes from the first session to the confirmation; markers are remounted with their bodies' own widths.

    Attributes:
        base_translation: Half width of the base's move, per axis [m].
        base_rotation: Half width of its turn [rad].
        encoder_zero: Standard deviation of a motor encoder's zero after homing again [rad]: three steps of the absolute
            encoder it is homed by.
    """

    base_translation: NonNegative = 0.08
    base_rotation: NonNegative = 0.5
    encoder_zero: NonNegative = 3e-4
