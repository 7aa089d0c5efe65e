"""What a scenario declares to the laboratory of how far a robot may be from nominal."""

from pydantic.dataclasses import dataclass

from twin.fields.values import STRICT, FixedNonNegative, FixedPositive


@dataclass(frozen=True, config=STRICT)
class Datasheet:
    """Tolerances declared to the laboratory, standard deviations; see `calibration.schema.Tolerances`."""

    joint_translation: FixedPositive
    joint_rotation: FixedPositive
    encoder_offset: FixedPositive
    joint_play: FixedPositive
    body_translation: FixedPositive
    body_rotation: FixedPositive
    link_mass: FixedPositive
    link_com: FixedPositive
    joint_delay: FixedPositive
    joint_delay_spread: FixedPositive
    joint_windup: FixedPositive
    payload_mass: FixedNonNegative
