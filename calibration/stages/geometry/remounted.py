"""A body of markers that was remounted, or slipped, between two static postures of a campaign.

    r = W (r_0 - C x) + noise of unit size       x (6,) twist of the body from a posture on, C its columns, 0 before
    x = A^-1 C' r,    A = C'C - C'J S J'C        r, J whitened; S the covariance of the geometry fitted without x

so x is what a fit with it would find, S letting the geometry follow it as far as its priors do; x' A x is chi-square
with 6 degrees of freedom where nothing slipped. Postures at rest show a smaller slip than motion does, whose residuals
have gears, clocks and the base in them: see `changes`.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from calibration.inference.parameters import Model
from calibration.mocap.postures import Postures
from calibration.numerics.lie import adjoint, inverse
from calibration.recording.schema import Description
from calibration.robot.blocks import Frames
from calibration.robot.hand import HandModel
from calibration.stages.geometry.hand_residual import HandResidual, NoiseModel
from calibration.verdict import Verdict

STAGE = "reading"
_CHANCE = 5.7e-7  # of a posture to begin with: five standard deviations
_ODD = 1e-9  # chance of a posture that belongs to the others
_FEWEST = 2  # postures on either side
_WRONG = 3.0  # tolerances beyond which the effect is not bounded


@dataclass(frozen=True)
class _White:
    """Whitened residuals r (n, 6) and derivatives J (n, 6, p), covariance S (p, p), and whiteners W (n, 6, 6)."""

    r: np.ndarray
    J: np.ndarray
    S: np.ndarray
    W: np.ndarray

    def step(self, X: np.ndarray, first: int) -> tuple[np.ndarray, float]:
        """x (6,) of columns X (n, 6, 6) from a row on, and its squared distance from 0."""
        C = self.W[first:] @ X[first:]
        JC = np.einsum("nkp,nkx->px", self.J[first:], C)
        A = np.einsum("nkx,nky->xy", C, C) - JC.T @ self.S @ JC
        b = np.einsum("nkx,nk->x", C, self.r[first:])
        x = np.linalg.solve(A, b)
        return x, float(b @ x)


def remounted(hand: HandModel, model: Model, postures: Postures, description: Description) -> Iterator[Verdict]:
    """A body of markers that is elsewhere from one of the postures, in their order, on, by the model's hand."""
    white, kept = _whitened(hand, model, postures)
    columns = {"hand": np.broadcast_to(np.eye(6), (len(kept), 6, 6)), "base": adjoint(inverse(kept.T_base_hand))}
    steps = range(_FEWEST, len(kept) - _FEWEST + 1)
    found = [(*white.step(X, k), body, k) for body, X in columns.items() for k in steps]
    if not found:
        return
    x, square, body, k = max(found, key=lambda one: one[1])
    if square < chdtri(6, _CHANCE):
        return
    tol, frames = description.tolerances, hand.block(Frames).names
    refused = float(np.abs(x / np.repeat([tol.body_translation, tol.body_rotation], 3)).max()) > _WRONG
    message = (
        f"markers of the {body} are elsewhere from posture {kept.label[k] if len(kept.label) else k} on by "
        f"{1e3 * np.linalg.norm(x[:3]):.1f} mm and {1e3 * np.linalg.norm(x[3:]):.0f} mrad"
    )
    remedy = "record again" if refused else "intervals include it; record again"
    names = frames[:6] if body == "base" else frames[6:]
    moves = (tuple(zip(names, map(float, x), strict=True)),)
    yield Verdict(STAGE, "refused" if refused else "warning", f"{message}; {remedy}", moves)


def _whitened(hand: HandModel, model: Model, postures: Postures) -> tuple[_White, Postures]:
    """Residuals by the model's values and noise, and the postures that belong to the others."""
    known = [k for k, p in enumerate(model.parameters) if p.name in hand.names]
    names, sigma = tuple(model.parameters[k].name for k in known), model.reading_sigma
    residual = HandResidual(hand, names, postures, NoiseModel(sigma, np.zeros(len(sigma)), np.zeros(0)))
    at = residual.linearise(np.array([model.parameters[k].value for k in known]))
    W = residual.noise.roots(at.B, np.append(sigma, 1.0))
    r = (W @ at.r[..., None])[..., 0]
    kept = (r**2).sum(axis=1) < chdtri(6, _ODD)
    S = model.random_covariance[np.ix_(known, known)]
    return _White(r[kept], (W @ at.J)[kept], S, W[kept]), postures.rows(kept)
