"""Run by the interpreter that has FIGAROH 1.0.2 installed, not by ours: its calibration of one CSV file.

    python figaroh_program.py TASK.json

TASK.json: urdf, train, test (CSV: x1, y1, z1, x2, ... [m] and a column per joint [rad, m]), joints, tool, method, out.
Fits marker positions with full_params and writes those it predicts at the readings of `test` to `out`.
"""

import contextlib
import io
import json
import os
import sys
import tempfile
from pathlib import Path
from typing import Any


class Robot:
    """All that BaseCalibration needs of a robot."""

    def __init__(self, urdf: str) -> None:
        import pinocchio as pin

        self.model = pin.buildModelFromUrdf(urdf)
        self.data = self.model.createData()
        self.q0, self.v0 = pin.neutral(self.model), [0.0] * self.model.nv


def configuration(task: dict[str, Any], markers: int) -> dict[str, Any]:
    """FIGAROH's unified configuration: base and tips free, all placements."""
    place = {"reference_joint": task["joints"][-1], "measurable_dof": 3 * [True] + 3 * [False], "sensor_type": "mocap"}
    return {
        "_metadata": {"schema_version": "2.0", "config_type": "robot_configuration"},
        "robot": {"name": "robot", "properties": {"joints": {"active_joints": task["joints"]}}},
        "tasks": {
            "calibration": {
                "enabled": True,
                "parameters": {
                    "calibration_level": "full_params",
                    "include_non_geometric": False,
                    "outlier_threshold": 0.05,
                    "estimation": {"method": task["method"]},
                },
                "kinematics": {"base_frame": "universe", "tool_frame": task["tool"]},
                "measurements": {
                    "markers": [{"name": f"m{k}"} | place for k in range(markers)],
                    "poses": {"base_pose": [0.0] * 6, "tool_pose": [0.0] * 6},
                },
                "data": {"source_file": task["train"], "validation_data_file": "", "number_of_samples": 100000},
            }
        },
    }


def main(path: str) -> None:
    """Calibrate and predict."""
    import numpy as np
    import yaml
    from figaroh.calibration.base_calibration import BaseCalibration
    from figaroh.calibration.calibration_tools import calc_updated_fkm
    from figaroh.calibration.data_loader import load_data

    class Calibration(BaseCalibration):  # type: ignore[misc]
        def cost_function(self, var: Any) -> Any:
            return self.PEE_measured - calc_updated_fkm(self.model, self.data, var, self.q_measured, self.calib_config)

    task = json.loads(Path(path).read_text(encoding="utf-8"))
    header = Path(task["train"]).read_text(encoding="utf-8").partition("\n")[0].split(",")
    markers = sum(name[:1] == "x" and name[1:].isdigit() for name in header)
    with tempfile.NamedTemporaryFile("w", suffix=".yaml", delete=False) as file:
        yaml.safe_dump(configuration(task, markers), file)
    with contextlib.redirect_stdout(io.StringIO()):
        robot = Calibration(Robot(task["urdf"]), file.name, del_list=[])
        os.unlink(file.name)
        robot.calib_config |= {"known_baseframe": False, "known_tipframe": False}
        robot.initialize()
        found = robot.solve(plotting=False, enable_logging=False)
        config = dict(robot.calib_config)
        _, q = load_data(task["test"], robot.model, config)
        predicted = np.asarray(calc_updated_fkm(robot.model, robot.data, found.x, q, config))
    np.save(task["out"], predicted.reshape(markers, 3, -1).transpose(2, 0, 1))


if __name__ == "__main__":
    main(sys.argv[1])
