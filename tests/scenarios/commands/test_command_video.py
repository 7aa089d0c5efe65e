"""`tiago-twin picture`: what it refuses, and that nothing half-written stays."""

import json

import pytest

from scenarios.commands import main
from scenarios.files.errors import ScenarioError
from scenarios.steps import video
from twin.rendering import ClipOptions, NothingToShow


@pytest.fixture
def run_folder(tmp_path):
    folder = tmp_path / "run"
    (folder / "dataset").mkdir(parents=True)
    (folder / "truth" / "trials").mkdir(parents=True)
    (folder / "scenario.yaml").write_text("name: x")
    trials = [{"id": "xyz", "role": "validation"}, {"id": "xyz_confirmation", "role": "confirmation"}]
    (folder / "dataset" / "dataset.json").write_text(json.dumps({"trials": trials}))
    return folder


def exit_code(*arguments):
    with pytest.raises(SystemExit) as left:
        main.main(["picture", *map(str, arguments)])
    return left.value.code


def test_it_must_be_given_what_to_write(run_folder, capsys):
    assert exit_code(run_folder) == 2
    assert "name a file: --clip FILE.gif, --still FILE.png" in capsys.readouterr().err


def test_what_is_written_has_the_ending_of_its_format(run_folder, tmp_path, capsys):
    assert exit_code(run_folder, "--clip", tmp_path / "x.png", "--still", tmp_path / "x") == 2
    first, second = capsys.readouterr().err.splitlines()
    assert first == f"--clip {tmp_path / 'x.png'}: it is written as GIF; name a file that ends in .gif"
    assert second == f"--still {tmp_path / 'x'}: it is written as PNG; name a file that ends in .png"
    assert not list(tmp_path.glob("x*"))


def test_a_folder_that_is_no_simulated_run_is_reported(tmp_path, capsys):
    assert exit_code(tmp_path, "--still", tmp_path / "a.png") == 2
    assert "contains no scenario.yaml; pictures need a run simulated here" in capsys.readouterr().err


def test_an_unknown_trial_is_answered_with_those_there_are(run_folder, tmp_path, capsys):
    assert exit_code(run_folder, "--trial", "zyx", "--still", tmp_path / "a.png") == 2
    assert "no trial 'zyx'; its trials are xyz, xyz_confirmation" in capsys.readouterr().err


def test_a_failed_clip_leaves_the_old_file_and_nothing_else(run_folder, tmp_path, monkeypatch):
    out = tmp_path / "out" / "a.gif"
    out.parent.mkdir()
    out.write_text("old")

    def fails(lab, trial, part, options, progress):
        part.write_text("half")
        raise NothingToShow("nothing")

    monkeypatch.setattr("twin.rendering.clip", fails)
    monkeypatch.setattr("scenarios.steps.run_steps.load", lambda path: __import__("scenarios").load("humanoids2024"))
    monkeypatch.setattr("twin.truth.read_trial", lambda path: None)
    with pytest.raises(NothingToShow):
        video.film(run_folder, "xyz", out, ClipOptions())
    assert [(p.name, p.read_text()) for p in out.parent.iterdir()] == [("a.gif", "old")]
    with pytest.raises(ScenarioError, match="no trial"):
        video.film(run_folder, "abc", out, ClipOptions())
