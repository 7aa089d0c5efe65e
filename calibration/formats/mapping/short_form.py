"""Short forms of a mapping file, written out before it is validated.

    setup.joints: {names: [a, b], prismatic: [a], link_encoders: [b], rate: 100.0}   a list of joints
    setup.tolerances: absent                                                         TYPICAL
    trials: {static: [s], swing: [u, v]}, validation: [v], confirmation: []          a list of trials
    csv[].markers: "{marker}_{axis}"                                                 of every marker of the bodies
    csv[].joints: {motor: "{joint}_q", link: "{joint}_l", unit: [rad, m]}            of every joint; m of a slide
    bodies[].pose: true                                                              columns of its pose
    c3d.markers: same, bag.joints: same                                              labels are the names

What has another form is left as it is: the validation judges it.
"""

from collections.abc import Callable
from typing import Any

TYPICAL = {
    "joint_translation": 0.003,
    "joint_rotation": 0.006,
    "encoder_offset": 0.06,
    "joint_play": 0.008,
    "body_translation": 0.005,
    "body_rotation": 0.02,
    "link_mass": 0.1,
    "link_com": 0.01,
}
"""Tolerances of an industrial or service robot and of measured marker bodies [m, rad, -], standard deviations."""

UNDRAWN = {"body_translation": 0.05, "body_rotation": 0.1}
"""Of marker bodies nobody measured."""

SAME = "same"
_ROLES = ("validation", "confirmation")


def written_out(values: dict[str, Any]) -> dict[str, Any]:
    """The mapping's values with every short form written out; what is missing in `setup` is found by the validation."""
    found = dict(values)
    setup = dict(found.get("setup") or {})
    short = setup.get("joints")
    found["setup"] = setup
    names, slides, linked = _joints(setup)
    setup["tolerances"] = {**TYPICAL, **(UNDRAWN if _undrawn(found) else {}), **(setup.get("tolerances") or {})}
    if isinstance(found.get("trials"), dict):
        found["trials"] = _trials(found)
    for role in _ROLES:
        found.pop(role, None)
    found["bodies"] = _posed(found.get("bodies"), found)
    markers = _marker_names(found["bodies"])
    if isinstance(found.get("csv"), list):
        linked = linked if isinstance(short, dict) else names
        found["csv"] = [_table(t, markers, names, slides, linked) if isinstance(t, dict) else t for t in found["csv"]]
    for key, field, all_names in (("c3d", "markers", markers), ("bag", "joints", names)):
        if isinstance(found.get(key), dict) and found[key].get(field) == SAME:
            found[key] = found[key] | {field: {n: n for n in all_names}}
    return found


def _joints(setup: dict[str, Any]) -> tuple[list[str], list[str], list[str]]:
    """Names of all joints, of the prismatic ones and of those with a link encoder; `setup.joints` is written out."""
    joints = setup.get("joints")
    if isinstance(joints, dict) and isinstance(joints.get("names"), list):
        names, slides, linked = joints["names"], joints.get("prismatic", []), joints.get("link_encoders", [])
        rest = {k: v for k, v in joints.items() if k not in ("names", "prismatic", "link_encoders")}
        setup["joints"] = [
            {"name": n, "encoders": ["motor", "link"] if n in linked else ["motor"]} | rest for n in names
        ]
        return names, slides, linked
    names = [j["name"] for j in joints if isinstance(j, dict) and "name" in j] if isinstance(joints, list) else []
    return names, [], names


def _undrawn(values: dict[str, Any]) -> bool:
    bodies = values.get("bodies")
    return isinstance(bodies, list) and any(isinstance(b, dict) and b.get("fitted") for b in bodies)


def _trials(values: dict[str, Any]) -> list[dict[str, Any]]:
    """A list of trials, kind by kind; of `calibration` unless named under another role."""
    role_of = {name: role for role in _ROLES for name in values.get(role) or []}
    kinds = ((kind, names) for kind, names in values["trials"].items() if isinstance(names, list))
    trials = [{"id": n, "role": role_of.pop(n, "calibration"), "kind": kind} for kind, names in kinds for n in names]
    # a name under a role that no kind has: as a trial without kind, which the validation finds missing
    return trials + [{"id": name, "role": role} for name, role in role_of.items()]


def _posed(bodies: Any, values: dict[str, Any]) -> Any:
    """Bodies with `pose: true` with the columns or the topic of their pose."""
    csv, bag = values.get("csv"), values.get("bag")
    tables = [*(csv if isinstance(csv, list) else ()), bag]
    if not isinstance(bodies, list):
        return bodies
    poses = {name: p for t in tables if isinstance(t, dict) for name, p in (t.get("poses") or {}).items()}
    return [
        b | {"pose": poses.get(b.get("name"), "named in no table's or bag's `poses`")}
        if isinstance(b, dict) and b.get("pose") is True
        else b
        for b in bodies
    ]


def _marker_names(bodies: Any) -> list[str]:
    if not isinstance(bodies, list):
        return []
    known = (b for b in bodies if isinstance(b, dict))
    names: list[str] = []
    for body in known:
        names += body.get("undrawn") or [m["name"] for m in body.get("markers") or [] if isinstance(m, dict)]
    return names


def _table(
    table: dict[str, Any], markers: list[str], joints: list[str], slides: list[str], linked: list[str]
) -> dict[str, Any]:
    """A CSV table with a column of every marker and joint."""
    found, pattern, short = dict(table), table.get("markers"), table.get("joints")
    if isinstance(pattern, str):
        found["markers"] = {m: [_filled(pattern, marker=m, axis=a) for a in "xyz"] for m in markers}
    if isinstance(short, dict) and any(isinstance(v, str) and "{joint}" in v for v in short.values()):
        of_unit: Callable[[str], Any] = _unit(short.get("unit"), slides)
        columns = {k: v for k, v in short.items() if k != "unit" and isinstance(v, str)}
        found["joints"] = {
            j: {k: _filled(v, joint=j) for k, v in columns.items() if k != "link" or j in linked} | {"unit": of_unit(j)}
            for j in joints
        }
    return found


def _unit(unit: Any, slides: list[str]) -> Callable[[str], Any]:
    if isinstance(unit, list) and len(unit) == 2:
        return lambda joint: unit[1] if joint in slides else unit[0]
    return lambda joint: unit


def _filled(pattern: str, **names: str) -> str:
    for name, text in names.items():
        pattern = pattern.replace("{" + name + "}", text)
    return pattern
