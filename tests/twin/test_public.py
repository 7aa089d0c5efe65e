"""The public way to the twin: cheap to import, a robot whose defects can be changed, its nominal values apart."""

import subprocess
import sys

import pytest

import twin
from twin.campaign import describe_dataset
from twin.config import SampledConfig, TwinConfig
from twin.defects import Cable, Flexibility


def test_importing_the_twin_loads_no_engine():
    script = "import sys, twin; print([n for n in ('mujoco', 'numpy', 'pydantic') if n in sys.modules])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "[]\n"), done.stderr


@pytest.mark.parametrize("name", twin.__all__)
def test_every_public_name_is_there(name):
    assert getattr(twin, name).__module__.startswith("twin.")


def test_a_name_that_is_not_public_is_refused():
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = twin.nothing


def test_a_defect_takes_the_place_of_its_like_or_is_added(lab):
    changed = lab.with_defects(Flexibility("torso_lift_link", 5e3, 10.0), Cable("arm_3_joint", 0.5, 0.1))
    before, after = ({p.name: p.value for p in one.twin.truth} for one in (lab, changed))
    different = {name for name in after if after[name] != before.get(name)}
    bending = {f"flexibility.torso_lift_link.{n}" for n in ("krx", "kry", "crx", "cry")}
    assert different == bending | {"cable.arm_3_joint.stiffness", "cable.arm_3_joint.rest"}
    assert len(changed.robot.defects) == len(lab.robot.defects) + 1
    assert len(changed.twin.truth) == len(after)


def test_true_values_are_no_description_of_a_dataset(config, lab):
    assert isinstance(config, TwinConfig) and isinstance(lab.config, SampledConfig)
    with pytest.raises(TypeError, match="nominal"):
        describe_dataset(lab.config, ())
