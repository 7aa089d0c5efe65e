"""Stage `base_frame`: the marker body in the base frame, from yaw spins and straight drives.

See `base_frame` for the model. A base on soft wheels rests neither quite upright nor quite at its nominal place,
the same at every heading, so that no motion on a floor separates it from a marker body that is mounted so. It may
differ from trial to trial, and what all trials have in common comes on top of the covariance.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from calibration.inference.parameters import Model, Parameter, Status
from calibration.recording.schema import Description
from calibration.robot.laboratory import Laboratory
from calibration.robot.nominal_frames import AXES, frame_names
from calibration.stages.frames.base_fit import BaseFrame, fit_base_frame
from calibration.stages.frames.base_rests import Stations, read_stations
from calibration.stages.frames.heins_baseline import Printed, printed_base_frame
from calibration.stages.stage import Stage, StageInput, StageResult
from calibration.verdict import Verdict

STAGE = "base_frame"
STANDING = np.array([0.0, 0.0, 2e-3, 2e-3, 2e-3, 0.0])  # of a base on its wheels: height [m], tilt [rad]
_FEWEST = 4  # rests a spin or drive needs: two give its direction, the rest its scatter
_CHI2 = 4.0  # squared whitened residual per degree of freedom from which rests are taken to differ [-]


def locate_base(lab: Laboratory, stations: Stations) -> tuple[Model | None, tuple[Verdict, ...]]:
    """Model `base_frame` with `frame.base.<body>.*`; None where there is no spin to fit."""
    short = [i for k, i in enumerate(stations.ids) if (stations.trial == k).sum() < _FEWEST]
    if short or "spin" not in stations.kinds:
        message = f"at least {_FEWEST} rests are needed in {short}" if short else "no yaw spin to show the centre"
        return None, (Verdict(STAGE, "missing", f"{message}; spin in steps over a turn, then drive straight"),)
    description, nominal, floor = lab.description, lab.nominal_frames[:6], np.zeros(3)
    if description.plates:
        floor = np.array(description.plates[0].centre)
    free = np.array([True, True, bool(description.plates), True, True, "drive" in stations.kinds])
    printed = printed_base_frame(stations)
    found = fit_base_frame(stations, np.where(free, printed.start(nominal), nominal), floor, free, STANDING[2:5])
    model = _model(description, found, nominal, free)
    return model, (*_refused(description, model, found), *_findings(stations, found, printed, free))


def _model(description: Description, found: BaseFrame, nominal: np.ndarray, free: np.ndarray) -> Model:
    tolerance = description.tolerances.body(description.base_body)
    covariance = max(1.0, found.chi2) * found.covariance[:6, :6] + np.diag(np.where(free, STANDING, tolerance) ** 2)
    status: tuple[Status, ...] = tuple("estimated" if f else "not_identifiable" for f in free)
    rows = zip(AXES, nominal, found.common.base, np.sqrt(np.diag(covariance)), status, strict=True)
    prefix = frame_names()[0]
    return Model(
        STAGE,
        tuple(
            Parameter(f"{prefix}.{a}", "m" if i < 3 else "rad", float(n), float(x), float(s), k)
            for i, (a, n, x, s, k) in enumerate(rows)
        ),
        covariance=covariance,
        rank=int(free.sum()),
    )


def _refused(description: Description, model: Model, found: BaseFrame) -> Iterator[Verdict]:
    tol = description.tolerances
    if not found.converged:
        yield Verdict(STAGE, "refused", "the fit did not come to rest: are these spins and drives on a floor?")
    for p in model.parameters:
        limit = tol.body_translation if p.unit == "m" else tol.body_rotation
        if p.status == "estimated" and p.sigma > limit:
            yield Verdict(
                STAGE, "refused", f"{p.name} is known to {p.sigma:.2g} {p.unit} only; spin over a turn, drive farther"
            )


def _findings(stations: Stations, found: BaseFrame, printed: Printed, free: np.ndarray) -> Iterator[Verdict]:
    """What was found, trial by trial where the base wandered."""
    away = found.common.base - printed.start(found.common.base)
    forward = f", forward {1e3 * abs(away[5]):.2f} mrad" if free[5] else ""
    yield Verdict(
        STAGE,
        "ok",
        f"{len(stations)} rests, {stations.kinds.count('spin')} spins and {stations.kinds.count('drive')} drives; "
        f"floor tilted {1e3 * float(np.hypot(*found.common.tilt)):.2f} mrad; the printed estimator's centre is "
        f"{1e3 * float(np.hypot(*away[:2])):.3f} mm away{forward}",
    )
    for index, (name, kind) in enumerate(zip(stations.ids, stations.kinds, strict=True)):
        xy = found.planar[stations.trial == index, :2]
        if kind == "spin":
            reach = 1e3 * float(np.linalg.norm(xy - xy.mean(axis=0), axis=1).max())
            own = 1e3 * float(np.hypot(*_eccentricity(found.planar[stations.trial == index])))
            text = (
                f"the centre wanders {1e3 * found.wander[index]:.3f} mm a step, {reach:.3f} mm in all; "
                f"its own lies {own:.3f} mm from that of all spins together"
            )
        else:
            way = float(np.linalg.norm(np.diff(xy, axis=0), axis=1).sum())
            text = f"{way:.2f} m, side slip {1e3 * found.wander[index]:.3f} mm a step"
        yield Verdict(STAGE, "ok", f"{name}: {text}")
    missing = [t for t, f in (("height: no force plate", free[2]), ("heading: no drive", free[5])) if not f]
    if missing:
        yield Verdict(STAGE, "warning", f"fixed at nominal: {', '.join(missing)}")
    if found.chi2 > _CHI2:
        message = (
            f"rests differ by {np.sqrt(found.chi2):.1f} times the markers' noise in tilt and height; sigmas include it"
        )
        yield Verdict(STAGE, "warning", message)


def _eccentricity(planar: np.ndarray) -> np.ndarray:
    """Where planar poses (n, 3) alone put the centre, in base axes (2,) [m]: least squares of xy_i + R_i e = const."""
    k, s, one, zero = np.cos(planar[:, 2]), np.sin(planar[:, 2]), np.ones(len(planar)), np.zeros(len(planar))
    A = np.concatenate([np.column_stack([k, -s, one, zero]), np.column_stack([s, k, zero, one])])
    found: np.ndarray = np.linalg.lstsq(A, -planar[:, :2].T.ravel(), rcond=None)[0][:2]
    return found


def with_base_frame(data: StageInput) -> StageInput:
    """With the base's marker body where spins and drives show it; as it was without them."""
    model = data.model(STAGE)
    if model is None:
        return data
    rows = np.array([(p.value, p.sigma) for p in model.parameters[:6]])  # clocks follow
    return replace(data, lab=data.lab.with_base_body(rows[:, 0], rows[:, 1]))


def _run(data: StageInput) -> StageResult:
    if not data.moves:
        return StageResult(findings=(Verdict(STAGE, "missing", "no trial of kind spin: T_base_B stays nominal"),))
    model, findings = locate_base(data.lab, read_stations(data.lab.description, data.moves))
    return StageResult(() if model is None else (model,), findings)


BASE_FRAME = Stage(STAGE, _run, lacks=lambda data: "")
