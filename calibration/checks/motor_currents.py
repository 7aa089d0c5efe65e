"""Motor currents whose columns are swapped or reversed, identified by the gravity torque of each joint at rest.

    e_j = tau_j(q) / k_j + friction + constant          r_jm = correlation of e_j with tau_m over postures at rest

tau the nominal robot's gravity torques, k_j > 0 gear and motor, which nobody needs to know. Of the twin's robots r_jj
is 0.96 and more, 0.3 where a harness pulls at the joint; a reversed current has r_jj near -1, another joint's follows
that one's torque instead. Joints that carry nothing (about the vertical, or the hand's own axis) have no r_jj; at few
postures chance alone has a large one: then nothing is reported. Each file is judged by itself, then all together.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from calibration.errors import InputError, InputErrors
from calibration.recording.posture_means import PostureMeans
from calibration.recording.trial import Trial
from calibration.robot.chain import Chain

_WINDOW, _STILL = 0.3, 2e-3  # [s] in which no joint moves by more [rad, m]
_ANOTHER = 0.02  # [rad, m] some joint moves by, between postures that count as two
_FEWEST = 12  # postures
_LOADED = 1.0  # [N.m, N] range of a torque that shows anything
_AGAINST, _FOLLOWS, _OWN = -0.8, 0.9, 0.5  # correlations


def check_currents(chain: Chain, trials: Sequence[tuple[str, Trial | PostureMeans]]) -> None:
    """Refuse motor currents that run against their joint's gravity torque, or follow another joint's.

    Args:
        chain: The nominal chain.
        trials: Of one session, each with the file it came from.

    Raises:
        InputError: It names the files, the joints and what to do.
    """
    logged = [(file, t) for file, t in trials if isinstance(t, Trial) and np.isfinite(t.effort).any()]
    at_rest = [_at_rest(trial) for _, trial in logged]
    problems = [
        InputError(file, message)
        for (file, _), x in zip(logged, at_rest, strict=True)
        if (message := _finding(chain, [x]))
    ]
    if problems:
        raise InputErrors(problems)
    if message := _finding(chain, at_rest):
        raise InputError(f"{logged[0][0]} and {len(logged) - 1} more", message)


def _finding(chain: Chain, at_rest: Sequence[tuple[np.ndarray, np.ndarray]]) -> str:
    """What is wrong with the currents of these files, if anything."""
    q, effort = (np.concatenate(x) for x in zip(*at_rest, strict=True)) if at_rest else (np.zeros((0, 0)),) * 2
    if len(q) < _FEWEST:
        return ""
    return "; ".join(_findings(chain.joints, _correlations(effort[:, chain.columns], chain.gravity_torques(q))))


def _at_rest(trial: Trial) -> tuple[np.ndarray, np.ndarray]:
    """Readings and currents (n, k) of each posture in which the robot rests: means over a window."""
    n = max(2, round(_WINDOW / float(np.median(np.diff(trial.t_robot)))))
    windows = len(trial.t_robot) // n
    q, effort = (x[: windows * n].reshape(windows, n, -1) for x in (trial.q_motor, trial.effort))
    still = (np.ptp(q, axis=1) < _STILL).all(axis=1)
    q, effort = q[still].mean(axis=1), effort[still].mean(axis=1)
    new = np.abs(np.diff(q, axis=0, prepend=np.inf)).max(axis=1) > _ANOTHER
    return q[new], effort[new]


def _correlations(effort: np.ndarray, torque: np.ndarray) -> np.ndarray:
    """r (k, k) of currents (n, k), by row, with torques (n, k); 0 where either is not excited."""
    e, tau = (x - x.mean(axis=0) for x in (np.where(np.isfinite(effort).all(axis=0), effort, 0.0), torque))
    tau = np.where(np.ptp(tau, axis=0) > _LOADED, tau, 0.0)
    sizes = np.outer(np.linalg.norm(e, axis=0), np.linalg.norm(tau, axis=0))
    return np.asarray(e.T @ tau / np.where(sizes > 0.0, sizes, np.inf))


def _findings(joints: Sequence[str], r: np.ndarray) -> Iterator[str]:
    for j, name in enumerate(joints):
        m = int(np.argmax(np.abs(r[j])))
        if r[j, j] < _AGAINST:
            yield (
                f"joint {name}: its motor current falls where gravity needs more torque (correlation {r[j, j]:.2f} "
                "at rest); correct its column, or name it in `reversed_effort` if its drive counts the other way"
            )
        elif m != j and abs(r[j, m]) > _FOLLOWS and r[j, j] < _OWN:
            yield (
                f"joint {name}: its motor current follows the gravity torque of {joints[m]} (correlation {r[j, m]:.2f} "
                f"at rest), not of itself ({r[j, j]:.2f}); the columns are swapped: correct the mapping file"
            )
