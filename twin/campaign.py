"""A whole campaign: one robot of the series, every trial simulated, measured and written.

    OUT/dataset/{dataset.json, nominal.urdf, trials/*.nc}      what a laboratory has
    OUT/truth/{truth.json, trials/*.nc}                        what nobody has

Trials run in parallel threads (the simulation holds no interpreter lock); random streams are named after the trial
and the instrument, so that the files do not depend on the number of threads.
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

import mjcf
from calibration.recording import Trial, write_trial
from calibration.schema import TrialEntry
from twin import session, truth
from twin.build import Twin, build
from twin.config import TwinConfig
from twin.conventions import exp6
from twin.declare import declaration
from twin.defects.base import Defect, Parameter
from twin.defects.departures import Warming
from twin.defects.ground import Wheel
from twin.defects.loads import Payload
from twin.defects.rolling import Rolling
from twin.draw import draw
from twin.gravity import gravity_stiffness
from twin.instruments.constants import constants
from twin.kinematic import arm_frame, carried
from twin.laboratory import EPOCH, Laboratory
from twin.measure import instrument_errors, is_carried, links_seen, measure, plate_centre
from twin.mesh_step import check_meshes
from twin.motions import Motion
from twin.schedule import schedule
from twin.session import CONFIRMATION, moved, remounted
from twin.simulate import States, simulate
from twin.slip import slip_loads
from twin.stiffness import spatial_stiffness
from twin.uncertain import drawn

Progress = Callable[[str, float], None]
Watch = Callable[[Trial], None]


def laboratory(config: TwinConfig, seed: int) -> Laboratory:
    """Draw a robot and put it on its plate."""
    config = drawn(config, seed)
    robot = draw(config, mjcf.model(), seed)
    twin = _built(config, robot.defects, links_seen(config, robot))
    x, y, yaw = config.base.pose
    T_lab_base = exp6(np.array([0.0, 0.0, 0.0, 0.0, 0.0, yaw]))
    T_lab_base[:3, 3] = x, y, config.instruments.plate_place.height
    return Laboratory(config, seed, robot, twin, T_lab_base)


def second_session(lab: Laboratory) -> Laboratory:
    """The same robot on another day."""
    robot = remounted(lab.config, lab.robot, lab.seed)
    return replace(lab, robot=robot, T_lab_base=moved(lab.config, lab.T_lab_base, lab.seed))


def record(
    config: TwinConfig,
    seed: int,
    out: Path,
    progress: Progress | None = None,
    threads: int | None = None,
    watch: Watch = lambda trial: None,
) -> None:
    """Simulate a campaign and write OUT/dataset and OUT/truth.

    Args:
        config: Robot and laboratory.
        seed: Root of every random stream.
        out: Folder to write into.
        progress: Called with a text and the fraction done.
        threads: How many trials are simulated at once; None: one for each core.
        watch: Called with each trial once it is written, by the thread that made it.

    Raises:
        TwinError: The simulation failed; said where.
    """
    lab = laboratory(config, seed)
    for folder in ("dataset/trials", "truth/trials"):
        (out / folder).mkdir(parents=True, exist_ok=True)
    motions = schedule(config.campaign, mjcf.model(), seed)
    later = second_session(lab) if any(m.role == CONFIRMATION for m in motions) else lab
    starts = EPOCH + np.cumsum([0.0, *(m.duration + config.campaign.pause for m in motions[:-1])])
    entries, done, total = [], 0.0, sum(m.duration for m in motions)
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        sessions = (later if m.role == CONFIRMATION else lab for m in motions)
        jobs = [
            pool.submit(_one, s, m, float(t), out, watch) for s, m, t in zip(sessions, motions, starts, strict=True)
        ]
        try:
            for motion, job in zip(motions, jobs, strict=True):
                entries.append(job.result())
                done += motion.duration
                if progress:
                    progress(f"simulated {motion.id}, {motion.duration:.0f} s", done / total)
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    description = declaration(config, tuple(entries))
    (out / "dataset/dataset.json").write_text(description.model_dump_json(indent=1) + "\n", encoding="utf-8")
    (out / "dataset/nominal.urdf").write_text(mjcf.urdf(), encoding="utf-8")
    _write_truth(lab, later if later is not lab else None, out / "truth")


def _one(lab: Laboratory, motion: Motion, start: float, out: Path, watch: Watch) -> TrialEntry:
    states = _states(lab, motion, start - EPOCH + motion.duration / 2.0)
    trial, true = measure(lab, motion, states, start)
    file = f"trials/{motion.id}.nc"
    digest = write_trial(out / "dataset" / file, trial)
    truth.write_trial(out / "truth" / file, true)
    watch(trial)
    return TrialEntry(
        id=motion.id,
        role=motion.role,
        kind=motion.kind,
        motion=motion.name,
        file=file,
        sha256=digest,
        payload=motion.payload,
    )


def _states(lab: Laboratory, motion: Motion, time: float) -> States:
    """What the motion does at `time` [s] of the campaign."""
    move = carried if is_carried(lab, motion) else simulate
    return move(_in_trial(lab, motion, time), motion, lab.T_lab_base)


def _in_trial(lab: Laboratory, motion: Motion, time: float) -> Twin:
    """The robot with the motion's payload in its hand, as warm as it is at `time` [s] of the campaign."""

    def now(defect: Defect) -> Defect:
        if isinstance(defect, Payload) and motion.payload is not None:
            return replace(defect, mass=motion.payload)
        if isinstance(defect, Wheel) and motion.base is not None and not is_carried(lab, motion):
            return Rolling(defect)
        return replace(defect, time=time) if isinstance(defect, Warming) else defect

    defects = tuple(now(d) for d in lab.robot.defects)
    if all(a is b for a, b in zip(defects, lab.robot.defects, strict=True)):
        return lab.twin
    return _built(lab.config, defects, lab.twin.links)


def _built(config: TwinConfig, defects: Sequence[Defect], links: Sequence[str]) -> Twin:
    twin = build(mjcf.spec(), defects, links, config.timestep)
    check_meshes(twin.model, config.arm)
    return twin


def _write_truth(lab: Laboratory, later: Laboratory | None, folder: Path) -> None:
    robot = lab.robot
    K, C = spatial_stiffness(robot.wheels)
    parameters: list[Parameter] = list(lab.twin.truth)
    for source in (*robot.encoders, *robot.clusters, *robot.loose, *instrument_errors(lab)):
        parameters += source.parameters()
    parameters += constants(lab.config)
    if "wheels" in lab.config.campaign.driving.forms:
        parameters += (p for wheel in robot.wheels for p in Rolling(wheel).parameters())
    if lab.config.campaign.driving.forms:
        parameters += arm_frame(lab.twin, next(iter(lab.config.arm)))
    derived = {"K": K, "C": C, "K_gravity": gravity_stiffness(lab.twin, robot.wheels)}
    derived |= {"slip_load": slip_loads(lab.twin, robot.wheels)}
    derived |= {"T_lab_base": lab.T_lab_base, "plate_centre": plate_centre(lab.twin.model)}
    derived |= {f"T_{c.frames.replace('.', '_')}": c.T_link_body for c in robot.clusters}
    if later is not None:
        parameters += session.parameters(later.robot)
        derived |= {f"{CONFIRMATION}.T_lab_base": later.T_lab_base}
        derived |= {f"{CONFIRMATION}.T_{c.frames.replace('.', '_')}": c.T_link_body for c in later.robot.clusters}
    truth.write_parameters(folder / "truth.json", parameters, derived)
