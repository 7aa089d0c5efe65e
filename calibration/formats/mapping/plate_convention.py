"""Whose wrench a force plate's file holds, in which axes and about which point; and whether its CoP agrees.

With the ACTION of the robot on the plate (f, m), lab axes z up, about the surface centre c, the centre of pressure is

    CoP = c + (-m_y / f_z, m_x / f_z)

which does not change when action and reaction are exchanged: that is shown by the sign of f_z, since a robot presses
down. So a file with CoP columns shows its own convention. It is not trusted over the mapping, nor the mapping over it:
when they contradict each other, both are reported and nothing is imported.
"""

from collections.abc import Iterator
from itertools import product

import numpy as np

from calibration.errors import InputError
from calibration.formats.mapping.layouts import MOMENTS, PlateChannels
from calibration.numerics.wrench import LOADED, centre_of_pressure
from calibration.recording.schema import Plate

_AGREES = 1e-3  # [m]
_MARGIN = 0.05  # [m] the centre of pressure may be outside the plate


def to_action(force: np.ndarray, moment: np.ndarray, channels: PlateChannels, plate: Plate) -> np.ndarray:
    """Wrenches (n, 6) [N, N.m] as ACTION on the plate, lab axes, about its surface centre."""
    f, m = force, moment
    if channels.axes == "plate":
        R = np.array(plate.axes).T
        f, m = f @ R.T, m @ R.T
    if channels.about == "lab":
        m = m - np.cross(plate.centre, f)
    sign = 1.0 if channels.convention == "action" else -1.0
    return sign * np.concatenate([f, m], axis=1)


def checked_against_cop(
    place: str,
    force: np.ndarray,
    moment: np.ndarray,
    cop: np.ndarray | None,
    channels: PlateChannels,
    plate: Plate,
) -> str:
    """Say how well the declared convention agrees with the file.

    Args:
        place: The file and its columns, for messages.
        force: (n, 3) as in the file [N].
        moment: (n, 3) as in the file [N.m].
        cop: (n, 3) centre of pressure [m, lab] as in the file, or None.
        channels: The declared convention.
        plate: The plate.

    Raises:
        InputError: The file contradicts the mapping.
    """
    wrench = to_action(force, moment, channels, plate)
    loaded = np.abs(wrench[:, 2]) > LOADED
    if not loaded.any():
        return f"plate {plate.name}: never loaded, so its convention could not be checked"
    _check_sign(place, wrench, loaded, channels, plate)
    if cop is None:
        _check_inside(place, wrench, loaded, plate)
        return f"plate {plate.name}: {_words(channels)} as declared; the file has no CoP to confirm it"
    error = _disagreement(wrench, loaded, cop, plate)
    if error < _AGREES:
        return f"plate {plate.name}: {_words(channels)}, confirmed by its CoP to {_length(error)}"
    fitting = next(_conventions(force, moment, loaded, cop, channels, plate), None)
    remedy = (
        f"its CoP agrees with {fitting}; map that"
        if fitting
        else (
            "no other convention agrees either: see the plate's centre and axes, the units and the order of the columns"
        )
    )
    raise InputError(
        place,
        f"plate {plate.name} declared as {_words(channels)}, but then its CoP is {_length(error)} off the file's own; "
        f"{remedy}",
    )


def _check_sign(place: str, wrench: np.ndarray, loaded: np.ndarray, channels: PlateChannels, plate: Plate) -> None:
    fz = float(np.mean(wrench[loaded, 2]))
    if fz > 0.0:
        other = "reaction" if channels.convention == "action" else "action"
        raise InputError(
            place,
            f"plate {plate.name} declared as {_words(channels)}, but then the robot would pull it up with {fz:.0f} N; "
            f"map convention: {other}, or turn the plate's axes if it is upside down",
        )


def _check_inside(place: str, wrench: np.ndarray, loaded: np.ndarray, plate: Plate) -> None:
    axes = np.array(plate.axes)
    local = (centre_of_pressure(wrench[loaded], np.array(plate.centre)) - plate.centre) @ axes.T
    beyond = float((np.abs(np.median(local, axis=0))[:2] - 0.5 * np.array(plate.size)).max())
    if beyond > _MARGIN:
        raise InputError(
            place,
            f"plate {plate.name}: its centre of pressure is {_length(beyond)} outside the plate; see the moments' "
            "unit, the point they are about and the order of the columns",
        )


def _disagreement(wrench: np.ndarray, loaded: np.ndarray, cop: np.ndarray, plate: Plate) -> float:
    """Median distance in the plane between computed and written CoP [m]."""
    d = (centre_of_pressure(wrench[loaded], np.array(plate.centre)) - cop[loaded])[:, :2]
    return float(np.nanmedian(np.linalg.norm(d, axis=1)))


def _conventions(
    force: np.ndarray, moment: np.ndarray, loaded: np.ndarray, cop: np.ndarray, channels: PlateChannels, plate: Plate
) -> Iterator[str]:
    """Conventions with which the centre of pressure is the file's."""
    turned = [plate.model_copy(update={"axes": axes}) for axes in _upright_axes()]
    for candidate, axes in ((plate, "lab"), (plate, "plate"), *((p, "plate") for p in turned)):
        for about, unit in product(("centre", "lab"), ("N.m", "N.mm")):
            other = channels.model_copy(update={"axes": axes, "about": about, "moment_unit": unit})
            scaled = moment * (MOMENTS[unit] / MOMENTS[channels.moment_unit])
            if _disagreement(to_action(force, scaled, other, candidate), loaded, cop, plate) < _AGREES:
                yield _words(other) + ("" if candidate is plate else f" with plate axes {candidate.axes}")


def _upright_axes() -> Iterator[tuple[tuple[float, ...], ...]]:
    """Axes along the lab's, z up or down, as columns."""
    for up, (x, y), sign in product((1.0, -1.0), ((1.0, 0.0), (0.0, 1.0)), (1.0, -1.0)):
        first = (sign * x, sign * y, 0.0)
        yield first, (-up * first[1], up * first[0], 0.0), (0.0, 0.0, up)


def _words(c: PlateChannels) -> str:
    about = "surface centre" if c.about == "centre" else "lab origin"
    return f"{c.convention}, {c.axes} axes, about the {about}, moments in {c.moment_unit}"


def _length(x: float) -> str:
    return f"{1e3 * x:.3g} mm"
