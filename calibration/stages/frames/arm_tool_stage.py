"""Stage `arm_tool`: the arm in the base frame and the hand in the tool frame, the arm itself as the factory left it.

See `arm_tool` for the fit. Gauge: while only the arm moves, the postures see T_B_arm = T_base_B^-1 T_base_arm and
T_tool_hand, twelve directions of eighteen; T_base_B from spins and drives splits the first. Its error moves T_base_arm
along with it,

    twist of the arm's base = Ad(T_B_arm^-1) twist of T_base_B

and both are in the model's covariance. Residuals larger than the measurement's noise are what "factory calibration is
good enough" leaves out. They are reported, they widen all sigmas, and what the arm's errors have in common, hidden in
the two frames, is taken to be as large as what they have not.
"""

from collections.abc import Iterator

import numpy as np
from scipy.linalg import block_diag

from calibration.inference.identifiability import Identifiability, identifiability
from calibration.inference.parameters import Model, Parameter, ParameterSet
from calibration.mocap.postures import Postures
from calibration.numerics.lie import adjoint, from_vector, inverse, local_twist, to_vector
from calibration.robot.laboratory import Laboratory
from calibration.robot.nominal_frames import AXES, PREFIX, arm_poses, frame_names, nominal_arm
from calibration.stages.frames.arm_tool_fit import ArmTool, fit_arm_tool, residuals
from calibration.stages.stage import Stage, StageInput, StageResult
from calibration.verdict import Verdict

STAGE = "arm_tool"
_CHI2 = 3.0  # squared whitened residual per degree of freedom from which the arm is taken to be off [-]
_STRAY = 60.0  # squared distance of a posture over their median from which it is taken not to belong [-]


def locate_arm(
    lab: Laboratory, postures: Postures, base_frame: Model | None, followed: bool = False
) -> tuple[Model, tuple[Verdict, ...]]:
    """Model `arm_tool`: `frame.base.<body>`, `frame.base.arm` and `frame.tool.hand`.

    Args:
        lab: Nominal robot and setup.
        postures: Static ones.
        base_frame: Of stage `base_frame`; None: the base's marker body is at its nominal place, to its tolerance.
        followed: Whether stage `geometry` follows, for which the arm need not be as it is drawn.

    Raises:
        NotEnoughData: The arm turns about one axis only.
    """
    chain, parameters = lab.chain, _parameters(lab)
    base, base_covariance, known = _base(parameters, base_frame)
    before = arm_poses(chain, postures.q)
    M = inverse(before) @ from_vector(base) @ postures.T_base_hand
    A = inverse(before) @ chain.poses(postures.q)
    found = fit_arm_tool(M, A, postures.covariance)
    stray = np.flatnonzero(found.distance > _STRAY * np.median(found.distance))
    if len(stray):
        found = fit_arm_tool(M, A, postures.covariance, robust=True)
    theta = np.concatenate([base, to_vector(nominal_arm(chain) @ found.X), to_vector(found.Y)])
    T_B_arm = inverse(from_vector(base)) @ before[0] @ found.X
    covariance = _covariance(theta, T_B_arm, base_covariance, _twists(found, M, A))
    seen = identifiability(np.vstack([_whitened(theta, found, A, postures, T_B_arm), known]), parameters)
    sigma = np.sqrt(np.diag(covariance))
    rows = zip(parameters.names, parameters.units, parameters.nominal, theta, sigma, seen.status, strict=True)
    model = Model(
        STAGE,
        tuple(Parameter(n, u, float(x0), float(x), float(s), status) for n, u, x0, x, s, status in rows),
        seen.combinations(parameters, theta, covariance),
        covariance,
        rank=seen.rank,
        condition=seen.condition,
    )
    return model, tuple(_verdicts(found, M, A, stray, seen, followed))


def _parameters(lab: Laboratory) -> ParameterSet:
    chain, frames, d, tol = lab.chain, lab.nominal_frames, lab.description, lab.description.tolerances
    base, hand = frame_names()
    return ParameterSet(
        tuple(f"{prefix}.{axis}" for prefix in (base, PREFIX, hand) for axis in AXES),
        ("m", "m", "m", "rad", "rad", "rad") * 3,
        np.concatenate([frames[:6], to_vector(nominal_arm(chain)), frames[6:]]),
        np.concatenate([tol.body(d.base_body), *[[tol.body_translation] * 3 + [tol.body_rotation] * 3] * 2]),
    )


def _base(parameters: ParameterSet, base_frame: Model | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """T_base_B (6,), its covariance (6, 6), and what is known of it as whitened rows (m, 18)."""
    if base_frame is None:
        return parameters.nominal[:6], np.diag(parameters.tolerance[:6] ** 2), np.zeros((0, 18))
    found = [p for p in base_frame.parameters if p.name in parameters.names[:6]]
    mine = [i for i, p in enumerate(found) if p.status == "estimated"]
    covariance = base_frame.covariance[:6, :6]
    known = np.zeros((len(mine), 18))
    known[:, mine] = np.linalg.inv(np.linalg.cholesky(covariance[np.ix_(mine, mine)]))
    return np.array([p.value for p in found]), covariance, known


def _covariance(theta: np.ndarray, T_B_arm: np.ndarray, base: np.ndarray, twists: np.ndarray) -> np.ndarray:
    """Covariance (18, 18) of the three frames, of T_base_B's (6, 6) and of the twists x, y (12, 12) at a given base."""
    G = np.zeros((18, 18))
    to_arm = np.linalg.inv(local_twist(theta[6:12]))
    G[:6, :6] = np.eye(6)
    G[6:12, :6] = to_arm @ adjoint(inverse(T_B_arm)) @ local_twist(theta[:6])
    G[6:12, 6:12], G[12:, 12:] = to_arm, np.linalg.inv(local_twist(theta[12:]))
    return G @ block_diag(base, twists) @ G.T


def _twists(found: ArmTool, M: np.ndarray, A: np.ndarray) -> np.ndarray:
    """Covariance (12, 12) of the twists of both frames, see the head of this file."""
    covariance = max(1.0, found.chi2) * found.covariance
    if found.chi2 > _CHI2:
        common = np.repeat([part**2 for part in _left(found, M, A)], 3) / 3.0
        covariance = covariance + np.diag(np.tile(common, 2))
    return covariance


def _left(found: ArmTool, M: np.ndarray, A: np.ndarray) -> tuple[float, float]:
    """Residuals' norm, rms over the postures [m, rad]."""
    r = residuals(found.X, found.Y, M, A)[0]
    squared = np.average(r**2, axis=0, weights=found.weight)
    return float(np.sqrt(squared[:3].sum())), float(np.sqrt(squared[3:].sum()))


def _whitened(theta: np.ndarray, found: ArmTool, A: np.ndarray, postures: Postures, T_B_arm: np.ndarray) -> np.ndarray:
    """Derivative (6 n, 18) of the hand's whitened pose in the base body by the three frames."""
    AY = A @ found.Y
    J = np.concatenate(
        [
            -adjoint(inverse(T_B_arm @ AY)) @ local_twist(theta[:6]),
            adjoint(inverse(AY)) @ local_twist(theta[6:12]),
            np.broadcast_to(local_twist(theta[12:]), (len(A), 6, 6)),
        ],
        axis=2,
    )
    W = np.sqrt(found.weight)[:, None, None] * np.linalg.inv(np.linalg.cholesky(postures.covariance))
    return (W @ J).reshape(-1, 18)


def _verdicts(
    found: ArmTool, M: np.ndarray, A: np.ndarray, stray: np.ndarray, seen: Identifiability, followed: bool
) -> Iterator[Verdict]:
    mm, mrad = (1e3 * part for part in _left(found, M, A))
    left = f"{mm:.3f} mm and {mrad:.3f} mrad rms left, {np.sqrt(found.chi2):.1f} times the noise"
    if not found.converged:
        yield Verdict(STAGE, "refused", f"the fit did not come to rest ({left})")
    yield Verdict(STAGE, "ok", f"arm base and tool from {len(M)} postures: {left}")
    if found.chi2 > _CHI2:
        does = "calibrates" if followed else "would calibrate"
        message = f"the arm is not as the factory drew it ({left}); sigmas are widened; stage geometry {does} it"
        yield Verdict(STAGE, "ok" if followed else "warning", message)
    if len(stray):
        yield Verdict(STAGE, "warning", f"postures {stray.tolist()} do not belong to the others and count less")
    if seen.rank < 18:
        yield Verdict(
            STAGE,
            "warning",
            f"gauge: {18 - seen.rank} of 18 directions are not separated. A base at rest shows T_base_B^-1 "
            "T_base_arm only; spins and drives (stage base_frame) split it",
        )


def _run(data: StageInput) -> StageResult:
    model, findings = locate_arm(data.lab, data.static, data.model("base_frame"), data.moving)
    return StageResult((model,), findings)


ARM_TOOL = Stage(STAGE, _run, needs="base_frame")
