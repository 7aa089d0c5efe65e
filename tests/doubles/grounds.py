"""What a base may stand on, as settings of a scenario."""

GROUNDS = {
    "contact": ["twin.base.wheels=contact"],
    "anchored": ["twin.base.wheels=anchored"],
    "rigid": ["twin.base.wheels=rigid"],
    "turning": [
        "twin.base.drive.friction=5.0",
        "twin.base.caster_front.friction=2.5",
        "twin.base.caster_front.turning_force=30.4",
        "twin.base.caster_back.friction=0.6",
        "twin.base.caster_back.turning_force=7.3",
    ],
    "twisting": [f"twin.base.{w}.torsion=[600.0, 500.0, 400.0]" for w in ("drive", "caster_front", "caster_back")],
}
"""`turning`: the default's friction times a sixth of 730 N, on a floor that holds, as `reality --causes` makes it."""
