"""An estimate as files.

    estimate.json            parameters, combinations, verdicts, clocks
    estimate.nc              covariances, one group a model
    record_next.yaml         postures and motions for what the data do not identify; only if there are any
    nominal.urdf             what the placement twists are relative to
    calibrated.urdf          joint placements of the exported model    } only if the result
    zeros.yaml               zeros of its readings                     } may be used: see `tables`
    master_calibration.yaml  the same geometry as PAL's robots read it } see `pal_calibration`
    parameters.csv           every parameter of every model            }

The same estimate gives the same bytes. `load_estimate` also reads another program's estimate.json or URDF.
"""

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from calibration.errors import InputError
from calibration.estimate.estimate import Estimate
from calibration.estimate.json_schema import EstimateFile, to_estimate, to_file
from calibration.estimate.pal_calibration import pal_calibration
from calibration.estimate.tables import parameters_text, read_zeros, zero_parameters, zeros_text
from calibration.inference.parameters import Model
from calibration.recording import netcdf
from calibration.recording.experiment import plans_text, read_plans
from calibration.robot.chain import chain_of_frames
from calibration.robot.urdf import calibrated_urdf
from calibration.stages.geometry.model_of_fit import hand_of
from calibration.untrusted import checked_urdf, findings, json_of, read_text

JSON, COVARIANCES, NOMINAL = "estimate.json", "estimate.nc", "nominal.urdf"
CALIBRATED, ZEROS, TABLE = "calibrated.urdf", "zeros.yaml", "parameters.csv"
PAL = "master_calibration.yaml"
NEXT = "record_next.yaml"


def save_estimate(estimate: Estimate, folder: Path | str) -> None:
    """Write the files of an estimate into a folder, made where it is missing."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    _replace_text(folder / JSON, json.dumps(to_file(estimate).model_dump(by_alias=True, exclude_none=True), indent=1))
    _write_covariances(folder / COVARIANCES, estimate)
    if estimate.urdf is not None:
        _replace_text(folder / NOMINAL, estimate.urdf)
    for name in (CALIBRATED, ZEROS, PAL, TABLE, NEXT):
        (folder / name).unlink(missing_ok=True)
    if estimate.remedies and estimate.robot is not None:
        _replace_text(folder / NEXT, plans_text(estimate.robot.joints, estimate.remedies))
    if estimate.calibrated and estimate.urdf is not None and estimate.robot is not None:
        chain = chain_of_frames(
            estimate.urdf, estimate.robot.joints, estimate.robot.base_frame, estimate.robot.tool_frame
        )
        hand = hand_of(estimate.model(estimate.exported), chain, np.zeros(12))
        if estimate.has_geometry:
            _replace_text(folder / CALIBRATED, calibrated_urdf(estimate.urdf, hand.chain))
            _replace_text(folder / ZEROS, zeros_text(hand))
            _replace_text(folder / PAL, pal_calibration(estimate.urdf, hand))
        _replace_text(folder / TABLE, parameters_text(estimate.models))


def load_estimate(path: Path | str, zeros: Path | str | None = None) -> Estimate:
    """Read an estimate: a folder written by `save_estimate`, an estimate.json, or a calibrated URDF.

    Of a URDF the geometry is taken, its row is named after the file; zeros of readings are those of the file `zeros`,
    else 0.

    Raises:
        InputError: There is nothing there that can be read.
    """
    path = Path(path)
    file = path / JSON if path.is_dir() else path
    text = read_text(file, hint="an estimate is a folder with estimate.json, or a URDF")
    if file.suffix.lower() in (".urdf", ".xml"):
        parameters = () if zeros is None else zero_parameters(read_zeros(zeros))
        checked_urdf(text, file)
        model = Model(file.stem, parameters, covariance=np.zeros((len(parameters), len(parameters))))
        return Estimate("calibrated", (), (), (model,), file.stem, text, registered=False)
    if zeros is not None:
        raise InputError(zeros, f"zeros go with a URDF; {file.name} has its own")
    try:
        found = EstimateFile.model_validate(json_of(text, file))
    except ValidationError as error:
        raise InputError(file, findings(error, "estimate")) from error
    nominal = file.parent / NOMINAL
    urdf = checked_urdf(read_text(nominal), nominal) if nominal.is_file() else None
    suggested = file.parent / NEXT
    remedies = read_plans(suggested)[1] if suggested.is_file() else ()
    every, random = (_read_covariances(file.parent / COVARIANCES, name) for name in ("covariance", "random"))
    try:
        estimate = to_estimate(found, urdf, every)
    except (ValueError, IndexError, KeyError, TypeError) as error:
        raise InputError(file, f"its arrays do not fit each other ({error}); write the estimate again") from error
    models = tuple(replace(m, random=random.get(m.name, m.random)) for m in estimate.models)
    for m in models:
        if any(len(x) and x.shape != 2 * (len(m.parameters),) for x in (m.covariance, m.random)):
            raise InputError(file, f"{m.name} has {len(m.parameters)} parameters, {COVARIANCES} those of others")
    return replace(estimate, models=models, remedies=remedies)


def _replace_text(path: Path, text: str) -> None:
    part = path.with_name(path.name + ".part")
    part.write_text(text if text.endswith("\n") else text + "\n", encoding="utf-8", newline="\n")
    os.replace(part, path)


def _write_covariances(path: Path, estimate: Estimate) -> None:
    part = path.with_name(path.name + ".part")
    with netcdf.created(part) as file:
        file.title = "covariance of the parameters of each model, units of the parameters"
        for model in estimate.models:
            group = file.createGroup(model.name)
            netcdf.add_dimensions(group, {"parameter": len(model.parameters)})
            netcdf.write_labels(group, {"parameter": tuple(p.name for p in model.parameters)})
            units = {"units": "product of the two parameters' units"}
            netcdf.write_variable(group, "covariance", model.covariance, ("parameter", "parameter"), "f8", units)
            if len(model.random):
                netcdf.write_variable(group, "random", model.random_covariance, ("parameter", "parameter"), "f8", units)
    os.replace(part, path)


def _read_covariances(path: Path, name: str = "covariance") -> dict[str, np.ndarray]:
    """Of the models that have it."""
    if not path.is_file():
        return {}
    with netcdf.opened(path, "write the estimate again") as file:
        return {m: netcdf.array(group, name) for m, group in file.groups.items() if name in group.variables}
