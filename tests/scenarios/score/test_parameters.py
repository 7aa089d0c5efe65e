import numpy as np

from calibration import Estimate
from calibration.inference.parameters import Model, Parameter
from scenarios.score.parameters import judge_estimate, with_holding
from twin.truth import Parameter as TrueParameter


def model(name, *parameters):
    found = tuple(Parameter(n, "-", 0.0, value, sigma, "estimated") for n, value, sigma in parameters)
    return Model(name, found, covariance=np.diag([p.sigma**2 for p in found]))


def test_every_estimated_parameter_of_every_model_is_judged_and_the_main_model_first():
    models = (
        model("model_1", ("suspension.K.11", 90.0, 10.0)),
        model("model_2", ("geometry.a.x", 1.0, 0.1)),
        model("full", ("geometry.a.x", 2.0, 0.1), ("gear.a.compliance", 5.0, 1.0), ("backlash.a.gap", 9.0, 1.0)),
    )
    true = {"geometry.a.x": 1.1, "gear.a.compliance": 5.5, "backlash.a.gap": 4.0, "suspension.K.11": 100.0, "b": 3.0}
    parameters, judged = judge_estimate(
        Estimate("calibrated", (), (), models, "model_2"), [TrueParameter(n, "-", v) for n, v in true.items()]
    )
    assert {p.name: (p.status, p.model) for p in parameters} == {
        "geometry.a.x": ("estimated", "model_2"),
        "gear.a.compliance": ("estimated", "full"),
        "backlash.a.gap": ("estimated", "full"),
        "suspension.K.11": ("estimated", "model_1"),
        "b": ("not_estimated", ""),
    }
    assert {name: (s.n_covered, s.n_judged) for name, s in judged} == {
        "model_2": (1, 1),
        "model_1": (1, 1),
        "full": (1, 3),
    }
    assert judged[0][0] == "model_2"


def test_a_link_s_friction_is_what_its_gear_and_its_holding_make_together():
    true = {"friction.a.coulomb": 0.5, "friction.b.coulomb": 0.2, "hysteresis.a.holding": 0.4, "hysteresis.a.slip": 2.0}
    found = {p.name: p.value for p in with_holding(TrueParameter(name, "N.m", value) for name, value in true.items())}
    assert found == {**true, "friction.a.coulomb": 0.9}
