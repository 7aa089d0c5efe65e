"""A mapping file drafted from laboratory files: what they show, and one marked line for each thing no file states.

A plate's centre, axes and size are the file's where it shows them.
"""

import re
from collections.abc import Iterator, Sequence

import numpy as np

from calibration.formats.mapping.poses import marker_names
from calibration.formats.survey.bodies import FoundBody
from calibration.formats.survey.plate_signs import division, reversed_force
from calibration.formats.survey.session import Session, sigmas_of
from calibration.formats.survey.trials import kind_of
from calibration.formats.survey.view import CHOOSE, GUESS, WHOSE, FileView, flow

_FARTHER, _MOVED = 5.0, 0.05  # [-], [m]: how far one body moves more than another where there is little doubt


def draft(session: Session, urdf: str, files: Sequence[str], wheels: str | None = None) -> str:
    """Text of the mapping file.

    Args:
        session: What the files show.
        urdf: How the mapping names the robot.
        files: Paths or patterns of the files beside the mapping.
        wheels: How it names the robot's wheels, None where it has none.
    """
    lines = [
        f"# Drafted from {len(session.views)} file(s), {len(session.trials)} trial(s). Lines marked CHOOSE state what",
        "# no file does: check each. GUESS: probable by the files, edit it only if it is wrong. Then",
        "# `tiago-twin process` this file. Fields: docs/recording.md.",
        f"urdf: {flow(urdf)}",
        f"files: {flow(list(files))}",
        "setup:",
        *(f"  {line}" for line in _setup(session, wheels)),
        *_bodies(session),
        *_trials(session),
        *_layouts(session),
    ]
    return "\n".join(lines) + "\n"


def _setup(session: Session, wheels: str | None) -> Iterator[str]:
    robot, names, tool = session.robot, session.measured, session.tool
    yield f"robot: {flow(robot.name)}"
    yield f"base_frame: {flow(robot.root)}"
    yield f"tool_frame: {flow(tool)}"
    joints = [r.joints for r in session.trials.values() if r.joints is not None]
    linked = [n for n in names if any(np.isfinite(j.q_link[:, j.names.index(n)]).any() for j in joints if n in j.names)]
    rate = float(np.median([1.0 / np.median(np.diff(j.t)) for j in joints])) if joints else 100.0
    entries = {
        "names": list(names),
        "prismatic": robot.prismatic(names),
        "link_encoders": linked,
        "rate": round(rate, 1),
    }
    yield f"joints: {flow({k: v for k, v in entries.items() if v})}"
    if wheels is not None:
        yield f"wheels: {flow(wheels)}"
    sensor, whose = session.wrist
    if sensor:
        why = f"{GUESS}: its weight turns as below this link" if whose else f"{CHOOSE}: the sensor's own frame"
        yield f"wrist_link: {flow(sensor)}  {why}"
    yield from _plates_of(session)
    yield (
        f"# payload: {{link: {tool}, mass: 0.5, com: [0.0, 0.0, 0.0], tolerance: 0.02}}  {CHOOSE}: uncomment "
        "if the hand carries a load [kg, m]"
    )
    if _in_base_frame(session):
        yield f"marker_frame: base  {GUESS}: one body only, so positions are in a frame at rest with the base"
    yield f"sigmas: {flow(sigmas_of(session))}"


def _plates_of(session: Session) -> Iterator[str]:
    plates = list({p.name: p for v in session.views for p in v.plates}.values())
    if plates:
        yield "plates:"
    for p in plates:
        place = [float(x) if np.isfinite(x) else "CHOOSE" for x in np.round(p.centre, 4) + 0.0]
        size = [float(x) if np.isfinite(x) else "CHOOSE" for x in np.round(p.size, 4)]
        known = np.isfinite([*p.centre, *p.size]).all()
        pressed = any(p.name == q.name for v in session.views if v.kind == "csv" for q in v.plates)
        note = "  # its edges are not in the file: as far as the pressure went" if pressed else ""
        note = note if known else f"  {CHOOSE}: centre of its surface in the lab, its edges [m]"
        axes = np.round(p.axes, 6) + 0.0
        yield f"  - {flow({'name': p.name, 'centre': place, 'axes': axes.tolist(), 'size': size})}{note}"


def _in_base_frame(session: Session) -> bool:
    return session.has_readings and len(session.bodies) == 1 and session.drawing is None


def _bodies(session: Session) -> Iterator[str]:
    if session.drawing is not None:
        yield f"bodies: {flow(session.drawing.file)}"
        return
    base, tool = session.robot.root, session.tool
    bodies = session.bodies
    yield "bodies:"
    if not bodies:
        yield f"  []  {CHOOSE}: no markers in these files; name the bodies and their markers"
    elif _in_base_frame(session):
        yield f"  - {flow({'name': 'base', 'link': base, 'fitted': True})}"
        yield f"  - {_body(bodies[0], tool, fitted=True)}"
    elif session.has_readings:
        least, most = (_mark(a, b) for a, b in ((bodies[1], bodies[0]), (bodies[-1], bodies[-2])))
        yield f"  - {_body(bodies[0], base, fitted=True)}  {least}: the base, it moves least"
        yield f"  - {_body(bodies[-1], tool, fitted=True)}  {most}: the hand, it moves most"
    else:
        x, y = _pressure(session)
        standing = f"{{x: {x}, y: {y}, heading: CHOOSE}}"
        what = "pose of the base frame at rest [m, rad, lab]"
        text = _body(bodies[0], base).removesuffix("}")
        yield f"  - {text}, standing: {standing}}}  {CHOOSE}: the base? it moves least; {what}"
    left = [n for b in (bodies[1:-1] if session.has_readings else bodies[1:]) for n in b.markers] + [*session.alone]
    if left:
        yield f"  # not used: {', '.join(left)}"


def _mark(body: FoundBody, other: FoundBody) -> str:
    """Whether a body moved so much more than another that there is little doubt which is which."""
    return GUESS if body.travel > max(_FARTHER * other.travel, _MOVED) else CHOOSE


def _body(body: FoundBody, link: str, **more: bool) -> str:
    if body.markers == marker_names(body.name):
        return flow({"name": body.name, "link": link, "pose": True} | more)
    return flow({"name": body.name, "link": link, "undrawn": list(body.markers)} | more)


def _pressure(session: Session) -> tuple[float | str, float | str]:
    """Where the centre of pressure is on average [m, lab]; a wheeled robot stands about there."""
    for p in (p for v in session.views for p in v.plates):
        w = np.nanmedian(p.wrench, axis=0)
        place = p.centre[:2] + np.array([-w[4], w[3]]) / w[2]
        if np.isfinite(place).all():
            return round(float(place[0]), 3), round(float(place[1]), 3)
    return "CHOOSE", "CHOOSE"


def _trials(session: Session) -> Iterator[str]:
    kinds: dict[str, list[str]] = {}
    for name, recorded in session.trials.items():
        kinds.setdefault(kind_of(recorded, session.bodies), []).append(name)
    yield "trials:"
    if list(kinds) == ["swing"] and len(session.trials) == 1 and session.bodies:
        ((name, recorded),) = session.trials.items()
        if (parts := division(recorded, session.bodies[-1])) is not None:
            why = f"{CHOOSE}: a log of one file, divided at a rest; role validation keeps a part aside"
            for k, part in enumerate(([0.0, parts[0]], [parts[0], parts[1]])):
                entry = {"id": f"{name}_{k + 1}", "file": name, "role": "calibration", "kind": "swing", "part": part}
                yield f"  - {flow(entry)}{'' if k else f'  {why}'}"
            return
    for kind, names in kinds.items():
        yield f"  {kind}: {flow(names)}"
    yield f"validation: []  {CHOOSE}: trials kept aside for the error: another motion, other postures"


def _layouts(session: Session) -> Iterator[str]:
    tables: dict[tuple[str, ...], FileView] = {}
    others: dict[str, list[FileView]] = {}
    for view in session.views:
        if view.kind == "csv":
            tables.setdefault(view.layout, view)
        else:
            others.setdefault(view.kind, []).append(view)
    if tables:
        yield "csv:"
    for layout, view in tables.items():
        static = view.recorded.means is not None
        lines = [f"suffix: {session.tails[view.path.name]}", *layout]
        why = "of a posture's mean position of a marker [m]"
        static = static and any(line.startswith("markers:") for line in layout)
        lines += [f"marker_std: {sigmas_of(session)['marker']:g}  {GUESS}: {why}"] if static else []
        yield from _nested([_known(session, line) for line in lines] + list(_plate_lines(session, view)), view)
    for kind, views in others.items():
        yield f"{kind}:"
        standing = max(views, key=lambda v: len(v.plates))
        shown = dict.fromkeys(line for v in views for line in v.layout)
        known = [_known(session, line) for line in shown]
        yield from (f"  {line}" for line in [*known, *_plate_lines(session, standing), *_unused(views[0])])


def _known(session: Session, line: str) -> str:
    """A line with whose wrench the wrist's sensor stores, where the recordings show it."""
    _, whose = session.wrist if WHOSE in line else ("", "")
    shown = f"{whose}{{}}  {GUESS}: the weight below the sensor turns with the readings as its {whose}"
    return re.sub(r"\baction(\}?)" + re.escape(WHOSE), lambda m: shown.format(m[1]), line) if whose else line


def _nested(lines: list[str], view: FileView) -> Iterator[str]:
    yield f"  - {lines[0]}"
    yield from (f"    {line}" for line in [*lines[1:], *_unused(view)])


def _plate_lines(session: Session, view: FileView) -> Iterator[str]:
    if view.plates:
        yield "plates:"
    for p in view.plates:
        force = float(np.nanmedian(p.wrench[:, 2]))
        why = f"the robot presses down, {force:+.0f} N along the upward axis"
        wrong = reversed_force(p, view.recorded.markers, session.bodies[-1]) if session.bodies else ""
        signs, seen = (f", reversed: [{wrong}]", f"; {wrong} against the hand's motion") if wrong else ("", "")
        yield f"  {flow(p.name)}: {{{p.layout}{signs}, convention: {p.convention}}}  {GUESS}: {why}{seen}"


def _unused(view: FileView) -> Iterator[str]:
    if view.left:
        yield f"# not used: {', '.join(view.left[:12])}{', ...' if len(view.left) > 12 else ''}"
