"""Mistakes of units, axes, order and names, rows as in `wrong_data`: seen in the recordings alone, and of the plate."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from calibration.recording.trial import Trial
from tests.hostile.campaign import Campaign, Spoil, hidden
from tests.hostile.wrong_data import STAGES, Mistake

_DEGREES = 180.0 / np.pi
_SWAPPED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def _array(name: str, change: Callable[[np.ndarray], np.ndarray]) -> Spoil:
    """Change a copy of an array of each calibration trial."""
    return lambda c: c.changed("calibration", lambda t, _: replace(t, **{name: change(getattr(t, name).copy())}))


def _column(joint: int, change: Callable[[np.ndarray], np.ndarray], side: str = "q_motor") -> Spoil:
    """Change the readings (n,) of one joint."""

    def of_array(q: np.ndarray) -> np.ndarray:
        q[:, joint] = change(q[:, joint])
        return q

    return _array(side, of_array)


def _listed(*keys: str | int, value: object) -> Spoil:
    """Another value in dataset.json; a function changes the one there."""

    def change(listed: dict) -> None:
        node = listed
        for key in keys[:-1]:
            node = node[key]
        node[keys[-1]] = value(node[keys[-1]]) if callable(value) else value

    return lambda c: c.redrawn(change)


def _labels(order: dict[str, str], share: float = 1.0) -> Spoil:
    """Markers under each other's names, for this share of the frames."""

    def of_trial(trial: Trial, _: str) -> Trial:
        p, every = trial.marker_position.copy(), list(trial.marker)
        columns = [every.index(order.get(name, name)) for name in every]
        rows = np.arange(len(p)) < share * len(p)
        p[rows] = p[rows][:, columns]
        return replace(trial, marker_position=p)

    return lambda c: c.changed("calibration", of_trial)


def _pairs(*pairs: tuple[str, str]) -> dict[str, str]:
    return {a: b for pair in pairs for a, b in (pair, pair[::-1])}


def _filled(how: str) -> Spoil:
    """A fifth of the markers hidden for half a second each, and put down as zero, or as where they were last."""

    def spoil(c: Campaign) -> Campaign:
        def of_trial(t: Trial, _: str) -> Trial:
            p = t.marker_position.copy()
            for k in range(p.shape[1]):
                bad = np.isnan(p[:, k, 0])
                last = np.maximum.accumulate(np.where(bad, 0, np.arange(len(p))))
                p[bad, k] = 0.0 if how == "zero" else p[last[bad], k]
            return replace(t, marker_position=p)

        return hidden(0.2, 0.5)(c).changed("calibration", of_trial)

    return spoil


KINDS = (
    Mistake("markers in millimetres", _array("marker_position", lambda p: 1000.0 * p), "in millimetres"),
    Mistake("joints in degrees", _array("q_motor", lambda q: _DEGREES * q), "in degrees"),
    Mistake("arm_1 in degrees", _column(1, lambda q: _DEGREES * q), "in degrees"),
    Mistake("lift in millimetres", _column(0, lambda q: 1000.0 * q), "torso_lift_joint' reads"),
    Mistake("drawing in millimetres", _listed("bodies", value=lambda b: [
        x | {"markers": [m | {"xyz": [v / 1000.0 for v in m["xyz"]]} for m in x["markers"]]} for x in b]),
        "times as far apart"),
    Mistake("sigma of markers 1e-9", _listed("sigmas", "marker", value=1e-9), "a marker moved"),
    Mistake("left-handed", _array("marker_position", lambda p: p * [1.0, -1.0, 1.0]), "as in a mirror"),
    Mistake("x and y exchanged", _array("marker_position", lambda p: p @ _SWAPPED), "as in a mirror"),
    Mistake("arm_1 reversed", _column(1, np.negative), "arm_1_joint' reads"),
    Mistake("arm_7 a turn too large", _column(7, lambda q: q + 2.0 * np.pi), "arm_7_joint' reads"),
    Mistake("arm_5 modulo a turn", _column(5, lambda q: q % (2.0 * np.pi)), "arm_5_joint' reads"),
    Mistake("gripper 1 and 2 exchanged", _labels(_pairs(("gripper1", "gripper2"))), "from its drawing"),
    Mistake("base 1 and 3 exchanged", _labels(_pairs(("base1", "base3"))), "from its drawing"),
    Mistake("hidden markers put down as zero", _filled("zero"), "a marker moved"),
)  # fmt: skip


def _plate(name: str, change: Callable[[np.ndarray], np.ndarray], says: str) -> Mistake:
    """The plate's wrench (n, plates, 6) changed."""
    return Mistake(name, _array("plate_wrench", change), says, stages=(*STAGES, "suspension"))


PLATE = (
    _plate("moments in N.mm", lambda w: w * [1.0, 1.0, 1.0, 1e3, 1e3, 1e3], "plate place"),
    _plate("forces in kgf", lambda w: w / 9.81, "plate scale"),
    _plate("reaction", np.negative, "plate sign: Fz"),
    _plate("moments first", lambda w: np.roll(w, 3, axis=2), "plate scale"),
    _plate("plate upside down", lambda w: w * [1.0, -1.0, -1.0, 1.0, -1.0, -1.0], "plate sign: Fz"),
    _plate("plate turned by half", lambda w: w * [-1.0, -1.0, 1.0, -1.0, -1.0, 1.0], "plate rotated by"),
    _plate("Mx reversed", lambda w: w * [1.0, 1.0, 1.0, -1.0, 1.0, 1.0], "Mx mirror"),
)
