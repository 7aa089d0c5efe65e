"""Links that balance at once in a step: their equations, and what sweeps alone leave of an oscillation."""

import numpy as np

from calibration.stages.drive_trains.kernel.balance import Meshes, Step, balanced, moved, swept
from calibration.stages.drive_trains.kernel.link_motion import contact, mesh

GAP, COULOMB, VISCOUS, H = 2e-3, 0.4, 0.2, 3.3e-3
VALUES = np.tile([GAP, 1e-4, COULOMB, VISCOUS, 2e-3, 1.0, 0.0], (3, 1))
ALL = np.ones(3, dtype=bool)
MESHES = Meshes(np.array([2, 1, 0]), ALL, ALL, VALUES)


def random_step(rng: np.random.Generator) -> tuple[np.ndarray, Step]:
    """Links near either flank, whose inertias are nine tenths shared."""
    links = np.zeros((3, 3))
    links[:, 0] = GAP * rng.choice([-1.0, 1.0], 3) + 2e-4 * rng.normal(size=3)
    links[:, 1] = 0.02 * rng.normal(size=3)
    root = rng.normal(size=(3, 3))
    M = root @ root.T + 0.05 * np.eye(3)
    speed = np.where(rng.random(3) < 0.3, 0.0, 0.3 * rng.normal(size=3))
    return links, Step(speed, 3.0 * rng.normal(size=3), M, 0.5 * np.eye(3))


def left(new: np.ndarray, links: np.ndarray, step: Step) -> np.ndarray:
    """(3,) of the balance, less friction: what friction has to hold or what slides."""
    found = step.M @ (new[:, 1] - links[:, 1]) / H + step.G @ new[:, 0] - step.load
    found -= VISCOUS * (step.speed - new[:, 1])
    return found + [
        mesh(x, rate, s, H, contact(v))[0] for (x, rate, _), s, v in zip(new, links[:, 2], VALUES, strict=True)
    ]


def test_forces_of_all_links_balance():
    rng, found, by_sweeps = np.random.default_rng(0), 0, 0.0
    for _ in range(300):
        links, step = random_step(rng)
        new = links.copy()
        swept(new, links, step, H, MESHES)
        from_there = new.copy()
        by_sweeps = max(by_sweeps, float(np.abs(np.clip(np.abs(left(new, links, step)) - COULOMB, 0.0, None)).max()))
        if not balanced(from_there, links, step, H, MESHES):
            continue
        found += 1
        moved(new, links, step, H, MESHES)
        np.testing.assert_allclose(new, from_there, atol=1e-9)  # wherever they were tried from
        u, force = step.speed - new[:, 1], left(new, links, step)
        np.testing.assert_allclose(new[:, 0], links[:, 0] + H * new[:, 1], atol=1e-15)
        slides = np.abs(u) > 1e-12
        np.testing.assert_allclose(force[slides], COULOMB * np.sign(u[slides]), atol=1e-6)
        assert np.all(np.abs(force[~slides]) <= COULOMB + 1e-6)
    assert found > 285 and by_sweeps > 1.0  # [N.m]


def test_links_stay_as_sweeps_have_them_where_no_end_is_found():
    links, step = random_step(np.random.default_rng(1))
    new = links.copy()
    swept(new, links, step, H, MESHES)
    before = new.copy()
    assert not balanced(new, links, step._replace(M=-step.M), H, MESHES)
    assert (new == before).all()


def test_links_that_are_not_free_stay_as_sweeps_have_them():
    links, step = random_step(np.random.default_rng(2))
    new = links.copy()
    swept(new, links, step, H, MESHES)
    before = new.copy()
    assert balanced(new, links, step, H, MESHES._replace(free=np.array([True, False, True])))
    assert (new[1] == before[1]).all() and (new[[0, 2]] != before[[0, 2]]).any()
    assert np.abs(left(new, links, step)[[0, 2]]).max() <= COULOMB + 1e-6
