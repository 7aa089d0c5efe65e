from scenarios.report.results.ladder import Step, readable
from scenarios.report.results.published import paper_steps


def step(model, base, encoder="motor"):
    return Step(model, base, encoder, "dynamic", None, None)


def test_each_model_of_the_paper_stands_by_its_best_prediction():
    steps = [step("nominal", "measured"), step("nominal", "fixed"), step("registration", "plate")]
    steps += [step("model_1", "measured"), step("model_1", "dynamics")]
    steps += [step("model_2", b) for b in ("fixed", "dynamics", "plate", "measured")]
    steps += [step("model_3", "plate", "link"), step("model_3", "fixed")]
    assert [(s.model, s.base) for s in paper_steps(steps)] == [
        ("nominal", "fixed"),
        ("model_1", "dynamics"),
        ("model_2", "plate"),
        ("model_3", "fixed"),
    ]


def test_an_oracle_of_the_base_alone_stands_for_no_model():
    assert paper_steps([step("model_1", "measured")]) == ()


def test_of_link_encoders_only_the_row_with_the_base_measured_is_drawn():
    steps = [step("model_3", b, "link") for b in ("fixed", "plate", "measured")] + [step("model_3", "plate")]
    assert [s.label for s in readable(steps)] == ["model_3, measured, link", "model_3, plate"]
