"""The stick-slip base as a model of prediction: a wrench in, the base's motion and its band out."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from calibration.errors import NoSuchElement
from calibration.numerics.signals import RATE
from calibration.stages.stick_slip.band import Band, PlainBand, reached
from calibration.stages.stick_slip.forcing import STEP, PlanarForcing, Tilting
from calibration.stages.stick_slip.kernel.bases import HEAVE, PLANE
from calibration.stages.stick_slip.kernel.informed import informed_along
from calibration.stages.stick_slip.kernel.integration import simulated
from calibration.stages.stick_slip.kernel.preloaded import noise_at_rest, weighed_along
from calibration.stages.stick_slip.likelihood import bases_of
from calibration.stages.stick_slip.wheels import SlipParameters, WheelSet, preloads
from calibration.stages.suspension.cross_validation import HeldOut
from calibration.stages.suspension.model import Source

EXPLAINED = 0.8  # R2 of yaw
PUSHED = {"plate": 0.02, "dynamics": 0.1}  # of its motion, one sigma: a push holds wheels at frictions that swings hide


@dataclass(frozen=True)
class PlanarPrediction:
    """Predicted motion in the floor's plane.

    Attributes:
        x: (n, 3) x, y, yaw since the first second [m, rad, frame 0].
        variance: (n, 3).
        share: (n,) of the wheels that slid.
        kept: (n, 3) w: how much of the predicted slip is believed [-].
    """

    x: np.ndarray
    variance: np.ndarray
    share: np.ndarray
    kept: np.ndarray


@dataclass(frozen=True)
class Direction:
    """What was fitted from one source of the wrench.

    Attributes:
        source: Of the wrench.
        logarithms: (p,) of the parameters, see `wheels.NAMES`; estimates of before have no preloads.
        covariance: (p, p).
        ensemble: (e, p) draws of the posterior, the optimum first.
        band: Of the prediction.
        held_out: Trials left out, (k, 3) for x, y, yaw.
        linear: (3,) axes that the compliance predicts better.
        plain: Band of the axes that are linear or stay.
        by_plate: Whether the plate's force corrects the prediction, where it is the source.
        heave: Band of z, rx, ry.
    """

    source: Source
    logarithms: np.ndarray
    covariance: np.ndarray
    ensemble: np.ndarray
    band: Band
    held_out: HeldOut
    linear: np.ndarray = field(default_factory=lambda: np.zeros(3, dtype=bool))
    plain: PlainBand = field(default_factory=lambda: PlainBand(np.full(3, 1e-3), np.ones(3)))
    heave: PlainBand = field(default_factory=lambda: PlainBand(np.full(3, 1e-4), np.full(3, 0.1)))
    by_plate: bool = field(default_factory=lambda: True)

    @property
    def corrected(self) -> bool:
        """Whether a force that a plate measured corrects the prediction."""
        return self.source == "plate" and self.by_plate

    def begun(self, load: np.ndarray) -> tuple[Band, float]:
        """The band of a trial that begins under a load (3,), and how far preloads are tried, as a share of the most."""
        return self.band.judged(load) if self.corrected else (self.band.begun(load), 1.0)

    @property
    def is_of_wheels(self) -> bool:
        """Whether wheels that stick and slip are what moves the base: no axis is linear, no force contradicts them."""
        return self.by_plate and not np.any(self.linear)

    @property
    def moved(self) -> np.ndarray:
        """(3,) axes predicted better than at rest, by trials left out that did not slip too far to be predicted.

        Where they show that slip explains yaw, all trials decide on x and y: the same wheels move them.
        """
        calm = self.held_out.only(~self.held_out.wild)
        return np.asarray(calm.moves | ((self.held_out.r2 > 0.0) & (calm.r2[2] >= EXPLAINED)))

    @property
    def slips(self) -> np.ndarray:
        """(3,) axes that the stick-slip model moves."""
        return self.moved & ~np.asarray(self.linear, dtype=bool)

    @property
    def parameters(self) -> SlipParameters:
        """The most likely parameters."""
        return SlipParameters.of(self.logarithms)


@dataclass(frozen=True)
class StickSlip:
    """A fitted base.

    Attributes:
        wheels: Of the robot.
        tilting: Compliance of heave and tilt.
        directions: One for each source.
    """

    wheels: WheelSet
    tilting: Tilting
    directions: tuple[Direction, ...]

    @cached_property
    def standing(self) -> np.ndarray:
        """Rows (m, 10) of the wheels as a plate's wrench finds them, see `Tilting.standing`."""
        return self.tilting.standing(self.wheels, "plate")

    def direction(self, source: Source) -> Direction:
        """What was fitted from a source.

        Raises:
            NoSuchElement: Nothing was.
        """
        found = next((d for d in self.directions if d.source == source), None)
        if found is None:
            raise NoSuchElement("source", source, [d.source for d in self.directions])
        return found

    def predict(self, forcing: PlanarForcing) -> PlanarPrediction:
        """The motion in the floor's plane under a forcing; by trials left out, an axis may stay or be linear.

        Raises:
            NoSuchElement: Nothing was fitted from its source.
        """
        found = self.direction(forcing.source)
        p, load = found.parameters, forcing.drive[0, 3:6]
        band, tried = found.begun(load)
        every, share, missed = self._motions(forcing, found, tried * preloads(self.wheels, p, load))
        n = len(found.ensemble)
        own = [0, *range(n, len(every))]
        shift, judged, preloaded = weighed_along(missed[own], every[own], 1.0 / RATE).transpose(1, 0, 2)
        x, spread = informed_along(missed[:n], every[:n], 1.0 / RATE).transpose(1, 0, 2)
        x = x + shift
        elastic = forcing.force @ np.linalg.inv(self.wheels.stiffness(p))
        slipped = reached(x - elastic)
        variance = band.variance(spread, preloaded, slipped) + judged
        kept = believed(slipped, variance - found.band.floor**2)
        x = elastic + kept * (x - elastic)
        plain = np.where(found.linear, forcing.linear, 0.0)
        variance = np.where(found.slips, variance, found.plain.variance(reached(elastic)))
        if forcing.pushed:
            variance = variance + PUSHED[forcing.source] ** 2 * reached(x)
        return PlanarPrediction(np.where(found.slips, x, plain), variance, share, kept)

    def _motions(
        self, forcing: PlanarForcing, found: Direction, preload: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Positions since the first second (k, n, 3), shares of the optimum's wheels that slid (n,), missing forces.

        Of the ensemble, then of the optimum from preloads (p, m, 2). The forces (k, n, 3) are over 2 sigma.
        """
        k, starts = len(found.ensemble), np.array([0, len(forcing.inertia)])
        e = np.concatenate([np.zeros((k, *preload.shape[1:])), preload])
        p = np.concatenate([found.ensemble, np.repeat(found.logarithms[None], len(preload), axis=0)])
        noise = noise_at_rest(forcing.force[forcing.rest].var(axis=0)) if found.corrected else None
        bases = bases_of(self.wheels, p, found.corrected, e, noise=noise)
        x, share, missed = simulated(starts, forcing.drive, forcing.inertia, bases, STEP, len(p))
        return x - x[:, forcing.rest].mean(axis=1, keepdims=True), share[0], missed

    def displacement(self, forcing: PlanarForcing) -> tuple[np.ndarray, np.ndarray]:
        """Displacement of the base frame (n, 6) [m, rad, frame 0] and its variances (n, 6)."""
        plane = self.predict(forcing)
        x, variance = np.empty((len(plane.x), 6)), np.empty((len(plane.x), 6))
        x[:, PLANE], variance[:, PLANE] = plane.x, plane.variance
        x[:, HEAVE] = forcing.heave
        variance[:, HEAVE] = self.direction(forcing.source).heave.variance(reached(forcing.heave))
        return x, variance


def believed(slipped: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """w (n, 3): the share of a predicted slip that is believed, by its largest square and the variance slips add."""
    return np.asarray(np.clip(1.0 - variance / np.maximum(slipped, np.finfo(float).tiny), 0.0, 1.0))
