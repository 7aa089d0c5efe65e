"""Mistakes of units, axes, order and names, rows as in `wrong_data`: seen in the recordings alone, and of the plate."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from calibration.recording.trial import Trial
from tests.hostile.rows.campaign import (
    Campaign,
    Spoil,
    exchanged_columns,
    hidden,
    link,
    lost_plate,
    plate_gain,
    shifted_dwells,
)
from tests.hostile.rows.wrong_data import STAGES, Mistake

_DEGREES = 180.0 / np.pi
_SWAPPED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def _array(name: str, change: Callable[[np.ndarray], np.ndarray], role: str = "calibration") -> Spoil:
    """Change a copy of an array of each trial of a role."""
    return lambda c: c.changed(role, lambda t, _: replace(t, **{name: change(getattr(t, name).copy())}))


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


def _labels(order: dict[str, str], share: float = 1.0, role: str = "calibration") -> Spoil:
    """Markers under each other's names, for this share of the frames."""

    def of_trial(trial: Trial, _: str) -> Trial:
        p, every = trial.marker_position.copy(), list(trial.marker)
        columns = [every.index(order.get(name, name)) for name in every]
        rows = np.arange(len(p)) < share * len(p)
        p[rows] = p[rows][:, columns]
        return replace(trial, marker_position=p)

    return lambda c: c.changed(role, of_trial)


def _in_one(spoil: Spoil, which: int = 0) -> Spoil:
    """A mistake of one calibration trial alone."""

    def of_one(c: Campaign) -> Campaign:
        name = c.ids("calibration")[which]
        return replace(c, trials=c.trials | {name: spoil(c).trials[name]})

    return of_one


def _urdf(old: str, new: str) -> Spoil:
    """Another nominal robot; `old` must be there."""

    def spoil(c: Campaign) -> Campaign:
        assert old in c.urdf, old
        return replace(c, urdf=c.urdf.replace(old, new, 1))

    return spoil


def _handed_over(body: str, at: float, role: str = "calibration") -> Spoil:
    """A body's first marker hidden for a fifth of a second, then its second one, at a share of each trial."""

    def spoil(c: Campaign) -> Campaign:
        def of_trial(t: Trial, _: str) -> Trial:
            p, start = t.marker_position.copy(), t.t_mocap[0] + at * np.ptp(t.t_mocap)
            for k, m in enumerate(c.bodies[body].markers[:2]):
                hidden_now = (t.t_mocap > start + 0.2 * k) & (t.t_mocap <= start + 0.2 * (k + 1))
                p[hidden_now, t.marker.index(m.name)] = np.nan
            return replace(t, marker_position=p)

        return c.changed(role, of_trial)

    return spoil


def _only_markers(names: tuple[str, ...], change: Callable[[np.ndarray], np.ndarray]) -> Spoil:
    """Change positions (n, m, 3) of some markers of each calibration trial."""

    def of_trial(t: Trial, _: str) -> Trial:
        p, columns = t.marker_position.copy(), [k for k, name in enumerate(t.marker) if name.startswith(names)]
        p[:, columns] = change(p[:, columns])
        return replace(t, marker_position=p)

    return lambda c: c.changed("calibration", of_trial)


def _frames_lost(seconds: float) -> Spoil:
    """No frames for a while in the middle of the first calibration trial."""

    def of_trial(t: Trial, _: str) -> Trial:
        kept = np.abs(t.t_mocap - t.t_mocap.mean()) > 0.5 * seconds
        return replace(t, t_mocap=t.t_mocap[kept], marker_position=t.marker_position[kept])

    return _in_one(lambda c: c.changed("calibration", of_trial))


def _first_dwells(n: int) -> Spoil:
    def of_trial(t: Trial, _: str) -> Trial:
        return replace(t, dwell_start=t.dwell_start[:n], dwell_stop=t.dwell_stop[:n], approach=t.approach[:n])

    return lambda c: c.changed("calibration", of_trial)


def _robot_moved(by: float) -> Spoil:
    """Robot and all markers shifted by (by, 0, 0) [m] in the middle of each calibration trial."""

    def of_trial(t: Trial, _: str) -> Trial:
        late = t.t_mocap > t.t_mocap.mean()
        return replace(t, marker_position=t.marker_position + np.where(late[:, None, None], [by, 0.0, 0.0], 0.0))

    return lambda c: c.changed("calibration", of_trial)


def _noisy(name: str, sigma: float) -> Spoil:
    return _array(name, lambda x: x + np.random.default_rng(0).normal(0.0, sigma, x.shape))


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
    Mistake("hidden markers put down where they were last", _filled("last"), "a marker moved"),
    Mistake("one trial in millimetres", _in_one(_array("marker_position", lambda p: 1000.0 * p)), "in millimetres"),
    Mistake("one trial in degrees", _in_one(_array("q_motor", lambda q: _DEGREES * q)), "in degrees"),
    Mistake("arm_1 a turn too large in one trial", _in_one(_column(1, lambda q: q + 2.0 * np.pi)),
        "arm_1_joint' reads"),
    Mistake("gripper 2 and 3 exchanged", _labels(_pairs(("gripper2", "gripper3"))), "drawing|as in a mirror"),
    Mistake("gripper 1 and 2 exchanged in one trial",
        _in_one(_labels(_pairs(("gripper1", "gripper2")))), "a marker moved|from its drawing"),
    Mistake("base and gripper exchanged",
        _labels(_pairs(*((f"base{k}", f"gripper{k}") for k in range(4)))), "times as far apart|drawing"),
    Mistake("base markers one on", _labels({f"base{k}": f"base{(k + 1) % 4}" for k in range(4)}), "drawing|mirror"),
    Mistake("x 1 % too large", _array("marker_position", lambda p: p * [1.01, 1.0, 1.0]), "between two directions"),
    Mistake("gripper1 and base1 exchanged", _labels(_pairs(("gripper1", "base1"))), "times as far apart|drawing"),
    Mistake("frames lost for 2 s", _frames_lost(2.0), "holes in the frames"),
)  # fmt: skip


def _plate(name: str, change: Callable[[np.ndarray], np.ndarray], says: str) -> Mistake:
    """The plate's wrench (n, plates, 6) changed."""
    return Mistake(name, _array("plate_wrench", change), says, stages=(*STAGES, "suspension"))


PLATE = (
    _plate("moments in N.mm", lambda w: w * [1.0, 1.0, 1.0, 1e3, 1e3, 1e3], "plate place"),
    _plate("forces in kgf", lambda w: w / 9.81, "plate scale"),
    _plate("reaction", np.negative, "plate sign: Fz"),
    _plate("moments first", lambda w: np.roll(w, 3, axis=2), "plate scale|plate sign: Fz"),
    _plate("plate upside down", lambda w: w * [1.0, -1.0, -1.0, 1.0, -1.0, -1.0], "plate sign: Fz"),
    _plate("plate turned by half", lambda w: w * [-1.0, -1.0, 1.0, -1.0, -1.0, 1.0], "plate rotated by"),
    _plate("Mx reversed", lambda w: w * [1.0, 1.0, 1.0, -1.0, 1.0, 1.0], "Mx mirror"),
    _plate("moments in kN.m", lambda w: w * [1.0, 1.0, 1.0, 1e-3, 1e-3, 1e-3], "plate scale: its moments"),
    _plate(
        "plate turned by a quarter",
        lambda w: np.concatenate([x[..., [1, 0, 2]] * [-1.0, 1.0, 1.0] for x in (w[..., :3], w[..., 3:])], axis=2),
        "plate",
    ),
    _plate("plate z down", lambda w: w * [1.0, -1.0, -1.0, 1.0, -1.0, -1.0], "plate sign: Fz"),
    _plate("plate reads zero", lambda w: 0.0 * w, "plate carries"),
    _plate(
        "plate saturated at 600 N",
        lambda w: np.maximum(w, [-1e9, -1e9, -600.0, -1e9, -1e9, -1e9]),
        "plate: Fz stays at -600",
    ),
    _plate("Fz of the plate missing", lambda w: w * [1.0, 1.0, np.nan, 1.0, 1.0, 1.0], ""),
    _plate("wrench of another moment", lambda w: np.roll(w, len(w) // 2, axis=0), "plate rotated by"),
    _plate("plate reversed in time", lambda w: w[::-1], ""),
    _plate("plate a quarter too heavy", lambda w: 1.25 * w, "plate scale"),
    _plate("30 kg on the plate", lambda w: w + [0.0, 0.0, -294.0, 0.0, 0.0, 0.0], "plate scale"),
    _plate(
        "moments about the laboratory's origin",
        lambda w: np.concatenate([w[..., :3], w[..., 3:] + np.cross([0.9, 0.45, 0.0], w[..., :3])], axis=2),
        "plate place",
    ),
    Mistake(
        "y up",
        _array("marker_position", lambda p: p[..., [0, 2, 1]] * [1.0, 1.0, -1.0]),
        "plate",
        stages=(*STAGES, "suspension"),
    ),
    Mistake(
        "payload in grams",
        _listed("payload", "mass", value=lambda m: 1000.0 * m),
        "plate scale",
        stages=(*STAGES, "suspension"),
    ),
    Mistake("gravity upwards", _listed("gravity", value=[0.0, 0.0, 9.81]), "plate", stages=(*STAGES, "suspension")),
    Mistake(
        "wheels ten times as far apart",
        _listed(
            "wheels",
            value=lambda ws: [
                w | {k: [10.0 * w[k][0], 10.0 * w[k][1], w[k][2]] for k in ("centre", "contact")} for w in ws
            ],
        ),
        "",
        stages=(*STAGES, "suspension"),
    ),
    Mistake(
        "laboratory turned by half against its plate",
        _array("marker_position", lambda p: p * [-1.0, -1.0, 1.0] + [1.8, 0.9, 0.0]),
        "plate",
        stages=(*STAGES, "suspension"),
    ),
    Mistake(
        "laboratory tilted by 5 deg",
        _array(
            "marker_position",
            lambda p: (
                p
                @ np.array(
                    [[1.0, 0.0, 0.0], [0.0, np.cos(0.0873), np.sin(0.0873)], [0.0, -np.sin(0.0873), np.cos(0.0873)]]
                )
            ),
        ),
        "",
        stages=(*STAGES, "suspension"),
    ),
)

_UP_TO = (
    "contradict|converge|off in scale|drift|plausible|times their prior|scatter|as large as by|elsewhere|reads|"
    "where the readings put"
)
FITTED = (
    Mistake("arm_3 reads a constant", _column(3, lambda q: 0.0 * q + q.mean()), _UP_TO),
    Mistake("arm_2 saturates", _column(2, lambda q: np.minimum(q, np.median(q))), _UP_TO),
    Mistake("lift twice as far", _column(0, lambda q: 2.0 * q), _UP_TO),
    Mistake("arm_7 reversed", _column(7, np.negative), _UP_TO),
    Mistake("arm_6 read 0.3 rad off", _column(6, lambda q: q + 0.3), "arm_6_joint slipped"),
    Mistake("rounded to a degree", _array("q_motor", lambda q: np.hstack(
        [q[:, :1], np.radians(np.round(np.degrees(q[:, 1:])))])), "", 1.6),
    Mistake("radians declared as degrees", _array("q_motor", lambda q: q / _DEGREES), "identifies the robot clock"),
    Mistake("readings of another moment", _array("q_motor", lambda q: np.roll(q, len(q) // 2, axis=0)),
        _UP_TO + "|no pose could be compared"),
    Mistake("readings reversed in time", _array("q_motor", lambda q: q[::-1]), _UP_TO),
    Mistake("readings with 20 ms of jitter", _array("t_robot", lambda t: np.sort(
        t + np.random.default_rng(0).normal(0.0, 0.02, len(t))) + 1e-6 * np.arange(len(t))), "jitter of the stamps"),
    Mistake("spikes in arm_4", _column(4, lambda q: q + 0.5 * (np.arange(len(q)) % 97 == 0)), "see its readings for"),
    Mistake("arm_4 late by 30 ms", _column(4, lambda q: np.roll(q, 3)), "see its readings for"),
    Mistake("two postures", _first_dwells(2), "distinct postures"),
    Mistake("five postures", _first_dwells(5), "distinct postures"),
    Mistake("approach reversed", _array("approach", np.negative), ""),
    Mistake("efforts of another robot", _array("effort", lambda x: -5.0 * x), ""),
    Mistake("markers scatter by 2 mm", _noisy("marker_position", 2e-3), "a marker moved"),
    Mistake("a third of all positions 50 mm off", _noisy("marker_position", 5e-2), _UP_TO),
    Mistake("hand markers never seen", _only_markers(("gripper",), lambda p: np.nan * p), "never seen"),
    Mistake("one hand marker alone", _only_markers(("gripper2", "gripper3", "gripper4"), lambda p: np.nan * p),
        "never seen"),
    Mistake("hand markers stand still", _only_markers(("gripper",), lambda p: p[:1] + 0.0 * p), _UP_TO),
    Mistake("base markers turned by half",
        _labels({f"base{k}": f"base{(k + 1) % 4 + 1}" for k in range(1, 5)}), "plausible"),
    Mistake("gripper 1 and 2 exchanged for a twentieth", _labels(_pairs(("gripper1", "gripper2")), 0.05), "", 1.05),
    Mistake("base 1 and 3 exchanged for a twentieth", _labels(_pairs(("base1", "base3")), 0.05), "", 1.05),
    Mistake("gripper4 hidden throughout", _only_markers(("gripper4",), lambda p: np.nan * p), "", 1.1),
    Mistake("shoulder markers exchanged", _labels(_pairs(("shoulder1", "shoulder2"))), "from their drawing"),
    *(Mistake(f"{body} hands over at {at}", _handed_over(body, at), "", 1.02)
        for body in ("base", "gripper") for at in (0.5, 0.8)),
    Mistake("every other frame lost", lambda c: c.changed("calibration", lambda t, _: replace(
        t, t_mocap=t.t_mocap[::2], marker_position=t.marker_position[::2])), "", 1.1),
    Mistake("robot moved by 5 mm", _robot_moved(5e-3), "", 1.02),
    Mistake("robot moved by 50 mm", _robot_moved(5e-2), "", 1.02),
    Mistake("sigma of markers a thousand times too large", _listed("sigmas", "marker", value=0.1),
        "markers scatter by"),
    Mistake("tolerances in millimetres", _listed("tolerances", value=lambda t: {
        k: v * 1000.0 if k.endswith("translation") else v for k, v in t.items()}), "not identifiable"),
    Mistake("tolerances a millionth", _listed("tolerances", value=lambda t: {
        k: 1e-6 * v if k.endswith(("translation", "rotation")) else v for k, v in t.items()}), "not identifiable"),
    Mistake("payload not declared", _listed("payload", value=None), ""),
    Mistake("tool frame on arm_5", _listed("tool_frame", value="arm_5_link"), "tool_frame|no marker body"),
    Mistake("hand markers drawn on arm_5", _listed("bodies", value=lambda b: [
        x | {"link": "arm_5_link"} if x["name"] == "gripper" else x for x in b]), _UP_TO + "|no marker body"),
    Mistake("base drawn 50 mm off", _listed("bodies", value=lambda b: [
        x | {"markers": [m | {"xyz": [m["xyz"][0] + 0.05, *m["xyz"][1:]]} for m in x["markers"]]}
        if x["name"] == "base" else x for x in b]), "nominal place"),
    *(Mistake(f"validation hand-over of {body}", _handed_over(body, 0.8, "validation"), "", 1.001)
        for body in ("base", "gripper")),
    Mistake("link of arm_3 copies its motor", link(3, lambda q, t: t.q_motor[:, 3]), "", 1.02),
    Mistake("link of arm_3 a turn off", link(3, lambda q, t: q + 2.0 * np.pi), "", 1.02),
    Mistake("columns of arm_5 and arm_7 exchanged", exchanged_columns(5, 7), "swapped|" + _UP_TO),
    Mistake("dwells on the robot's clock", lambda c: shifted_dwells(-c.late)(c), "dwells|" + _UP_TO),
    Mistake("upper arm 100 mm longer in the URDF", _urdf("-0.02 -0.027 -0.222", "-0.02 -0.027 -0.322"), _UP_TO),
    Mistake("arm_4 turned in the URDF", _urdf("-1.5707963267948966 -1.5707963267948966 0",
        "-1.4 -1.5707963267948966 0"), "", 1.05),
    Mistake("arm_5 reversed in the URDF", _urdf('"0 -1.5707963267948966 0" />\n    <axis xyz="0 0 1" />',
        '"0 -1.5707963267948966 0" />\n    <axis xyz="0 0 -1" />'), _UP_TO),
    Mistake("hand drawn turned by half", _listed("bodies", value=lambda b: [
        x | {"markers": [m | {"xyz": [-m["xyz"][0], -m["xyz"][1], m["xyz"][2]]} for m in x["markers"]]}
        if x["name"] == "gripper" else x for x in b]), _UP_TO),
    Mistake("5 % of frames lost", hidden(0.05, 0.0), "", 1.1),
    Mistake("plate lost throughout", lambda c: lost_plate(0.0, 1e3)(c), "", 1.02),
    Mistake("plate a fifth too light", plate_gain(0.8), "", 1.02),
)  # fmt: skip
UNSEEN = (
    Mistake("validation in degrees", _array("q_motor", lambda q: _DEGREES * q, "validation"), "in degrees"),
    Mistake("validation with gripper 1 and 2 exchanged",
        _labels(_pairs(("gripper1", "gripper2")), 1.0, "validation"), "drawing|a marker moved|as in a mirror"),
    Mistake("validation with base markers exchanged", _labels(
        {f"base{k}": f"base{(k + 1) % 4 + 1}" for k in range(1, 5)}, 1.0, "validation"),
        "elsewhere|the hand is|drawing"),
    Mistake("validation plate's reaction", _array("plate_wrench", np.negative, "validation"), "plate"),
    Mistake("validation columns of arm_3 and arm_4 exchanged",
        _array("q_motor", lambda q: q[:, [0, 1, 2, 4, 3, 5, 6, 7]], "validation"), "reads|slipped|the hand is"),
)  # fmt: skip
TABLES = (KINDS, PLATE, FITTED, UNSEEN)
