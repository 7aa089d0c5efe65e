"""What the wrist's sensor says hangs on it, held against the drawing and the declared payload.

    R_base_sensor = R_base_B R_B_H R_H_tool R_tool_sensor       R_B_H measured by the markers in each dwell

Angles behind gears would not do: a hand that sags by 10 mrad always sags with gravity, and weighs 1 % less.
"""

from collections.abc import Sequence

import numpy as np

from calibration.clock import Clock
from calibration.errors import NotEnoughData
from calibration.hand import HandModel
from calibration.hand_payload import Hanging, drawn, weigh
from calibration.postures import Postures, dwell_windows
from calibration.recording import Trial
from calibration.schema import Description
from calibration.se3 import from_vector, inverse
from calibration.verdict import Verdict

_STAGE = "geometry"
_CLEAR = 3.0  # standard deviations
_FEW = 5  # samples of a dwell
_SETTLED = 0.5  # share of a dwell after which an arm has stopped ringing: a mean over turned forces is too small


def weighed(
    urdf: str,
    description: Description,
    trials: Sequence[Trial],
    robot: Clock | None,
    hand: HandModel,
    postures: Postures,
) -> tuple[Verdict, ...]:
    """What is to be said of the load of the hand; nothing where no wrist was recorded.

    Args:
        urdf: Of the nominal robot.
        description: Of the dataset, its payload that of these trials.
        trials: Continuous ones; their dwells count.
        robot: The robot's clock.
        hand: The calibrated robot.
        postures: Those of the trials that show base and hand.
    """
    recorded = [trial for trial in trials if np.isfinite(trial.wrist_wrench).any()]
    if not recorded or robot is None:
        return ()
    link = description.wrist_link
    if link is None:
        return (Verdict(_STAGE, "missing", "wrist_wrench is recorded, but wrist_link does not say where: not used"),)
    w = _means(recorded, robot)
    rows = [k for k, label in enumerate(postures.label) if label in w and postures.components == 6]
    if not rows:
        return (Verdict(_STAGE, "missing", "wrist_wrench is recorded, but in no static posture: not used"),)
    seen = postures.rows(np.array(rows))
    R = _turned(hand, seen, link)
    try:
        found = weigh(R, np.array([w[label] for label in seen.label]), np.array(description.gravity))
    except NotEnoughData as error:
        return (Verdict(_STAGE, "missing", str(error)),)
    return (_judged(found, drawn(urdf, description, link), link, len(seen)),)


def _turned(hand: HandModel, postures: Postures, link: str) -> np.ndarray:
    """R_base_sensor (n, 3, 3)."""
    q = hand.angles(postures.q)
    T_base_tool = from_vector(hand.base) @ postures.T_base_hand @ inverse(from_vector(hand.hand)[None])
    T_tool_sensor = inverse(hand.chain.poses(q)) @ hand.chain.poses(q, link)
    return np.asarray((T_base_tool @ T_tool_sensor)[:, :3, :3])


def _means(trials: Sequence[Trial], robot: Clock) -> dict[str, np.ndarray]:
    """Mean wrench (6,) of each dwell by the label of its posture."""
    found = {}
    for trial in trials:
        t, known = robot.to_mocap(trial.t_robot), np.isfinite(trial.wrist_wrench).all(axis=1)
        for k, (start, stop) in enumerate(dwell_windows(trial)):
            rows = (t >= start + _SETTLED * (stop - start)) & (t <= stop) & known
            if rows.sum() >= _FEW:
                found[f"{trial.id} {k}"] = trial.wrist_wrench[rows].mean(axis=0)
    return found


def _judged(found: Hanging, expected: Hanging, link: str, n: int) -> Verdict:
    message = (
        f"wrist: {found.mass:.3f} +- {found.sigma[0]:.3f} kg hang on {link}, centre {_millimetres(found.centre)} mm "
        f"+- {_millimetres(found.centre_sigma, 1)}, "
        f"{n} postures; drawing and declared payload: {expected.mass:.3f} +- {expected.sigma[0]:.3f} kg"
    )
    more = found.less(expected)
    if abs(more.mass) <= _CLEAR * more.sigma[0]:
        return Verdict(_STAGE, "ok", message)
    if more.mass > 0.0:
        at = _millimetres(more.centre)
        remedy = f"declare the other {more.mass:.3f} kg, at {at} mm in its axes, as payload, or weigh the tool"
    else:
        remedy = "is the declared payload in the hand, the sensor in newton?"
    return Verdict(_STAGE, "warning", f"{message}: {remedy}")


def _millimetres(x: np.ndarray, digits: int = 0) -> str:
    return "(" + ", ".join(f"{1e3 * v:.{digits}f}" for v in x) + ")"
