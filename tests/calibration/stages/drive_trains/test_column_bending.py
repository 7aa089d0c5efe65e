import numpy as np
import pinocchio as pin
import pytest

import mjcf
from calibration.robot.chain import chain_of
from calibration.stages.drive_trains.column_bending import ColumnBending, leaning, rigid
from tests.doubles import rigid_robot


def test_a_column_leans_by_what_its_own_centre_of_mass_may_be_off():
    """The torso's link on its compliance, its centre of mass one tolerance to the side: by inverse dynamics."""
    description = rigid_robot.described()
    chain = chain_of(mjcf.urdf(), description)
    bending = ColumnBending(chain.joints[0], np.array([8e-5, 9e-5]), np.array([1e-6, 1e-6]))
    off = description.tolerances.link_com

    def moment(levers):
        model = chain.nominal.copy()
        own = model.getJointId(chain.joints[0])
        body = model.inertias[own]
        model.inertias[own] = pin.Inertia(body.mass, body.lever + levers, body.inertia)
        data, still = model.createData(), np.zeros(model.nv)
        pin.rnea(model, data, pin.neutral(model), still, still)
        return data.f[own].angular

    M_x = moment([0.0, off, 0.0]) - moment([0.0, 0.0, 0.0])
    M_y = moment([off, 0.0, 0.0]) - moment([0.0, 0.0, 0.0])
    found = leaning(bending, chain, description)
    assert found == pytest.approx([8e-5 * abs(M_x[0]), 9e-5 * abs(M_y[1])])
    assert 2e-5 < found[0] < 2e-4


def test_a_rigid_column_does_not_lean():
    description = rigid_robot.described()
    chain = chain_of(mjcf.urdf(), description)
    np.testing.assert_array_equal(leaning(rigid(chain.joints[0]), chain, description), 0.0)
