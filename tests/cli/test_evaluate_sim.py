"""`twbal evaluate-sim`: what it reads, compares, writes and refuses."""

import hashlib
import json
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from twbal.algorithm.distribution_file import save_distribution
from twbal.cli.main import main
from twbal.core.episode import Provenance
from twbal.core.json_records import read_record
from twbal.diagnosis.evaluation_record import SimulationEvaluation
from twbal.io.logs import write_episode
from twbal.planar.robot_distribution import prior_of

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "diagnosis"))
from evaluated_logs import TRUE, log

QUICK = ["horizons=[0.1,0.15]"]


@pytest.fixture(scope="module")
def logs(paper, tmp_path_factory):
    """Two run folders with one log each, of the same file name."""
    folder = tmp_path_factory.mktemp("logs")
    for name, seed in (("day_1", 1), ("day_2", 2)):
        write_episode(folder / name / "episodes" / "0.mcap", log(paper, TRUE, seed, periods=600).episode)
    return folder


@pytest.fixture(scope="module")
def found(logs):
    """A run folder with a simulation that says of its own manifest what it was found on, and a wrong simulation."""
    folder = logs / "found"
    folder.mkdir()
    text = "effects:\n  coulomb_friction: {torque: 0.3}\n  actuation_delay: {delay: 0.02}\n"
    (folder / "augmented.yaml").write_text(text)
    (folder / "wrong.yaml").write_text("effects:\n  viscous_friction: {coefficient: 0.5}\n  com_offset: {angle: 0.1}\n")
    first = logs / "day_1" / "episodes" / "0.mcap"
    manifest = {
        "stage": "diagnose",
        "complete": True,
        "fingerprint": "",
        "seed": 0,
        "settings": "",
        "inputs": {"episodes": [{"path": str(first), "sha256": sha256(first)}]},
        "outputs": [{"path": "augmented.yaml", "sha256": sha256(folder / "augmented.yaml")}],
        "versions": {},
        "started": "",
        "wall_s": 1.0,
    }
    (folder / "manifest.json").write_text(json.dumps(manifest))
    return folder


def sha256(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def evaluate(logs, out, *words):
    return main(
        ["evaluate-sim", f"episodes=[{logs / 'day_1'},{logs / 'day_2'}]", f"hydra.run.dir={out}", *QUICK, *words]
    )


@pytest.fixture(scope="module")
def evaluated(logs, found, tmp_path_factory):
    out = tmp_path_factory.mktemp("out")
    assert evaluate(logs, out, f"sims=[nominal,{found / 'augmented.yaml'},{found / 'wrong.yaml'}]") == 0
    return out


def test_the_nominal_simulation_is_always_there_once_and_logs_of_one_name_are_told_apart(evaluated):
    record = read_record(SimulationEvaluation, evaluated / "evaluation.json")
    assert [each.name for each in record.simulations] == ["nominal", "augmented", "wrong"]
    assert [each.name for each in record.logs] == ["day_1/0", "day_2/0"]
    assert record.reference == "nominal"
    assert len(record.scores) == 3 * 3 * 4 * 2  # simulations, logs and their pool, channels, horizons


def test_a_simulation_is_marked_where_its_manifest_names_the_log(evaluated):
    record = read_record(SimulationEvaluation, evaluated / "evaluation.json")
    assert [each.found_on for each in record.simulations] == [(), ("day_1/0",), ()]
    own = {(score.simulation, score.log) for score in record.scores if score.is_own_data}
    assert own == {("augmented", "day_1/0"), ("augmented", "all logs")}


def test_a_log_of_the_same_name_is_told_from_the_one_that_a_simulation_was_found_on(logs, found, tmp_path):
    words = [f"episodes={logs / 'day_2'}", f"sims=[{found / 'augmented.yaml'}]", f"hydra.run.dir={tmp_path}", *QUICK]
    assert main(["evaluate-sim", *words]) == 0
    record = read_record(SimulationEvaluation, tmp_path / "evaluation.json")
    assert [each.name for each in record.logs] == ["0"]
    assert record.simulations[1].found_on == ("day_1/0",)
    assert not any(score.is_own_data for score in record.scores)


def test_a_simulation_that_is_not_the_nominal_one_is_not_called_so(logs, found, tmp_path, capsys):
    assert evaluate(logs, tmp_path, f"sim={found / 'wrong.yaml'}", "sims=[nominal]") == 0
    record = read_record(SimulationEvaluation, tmp_path / "evaluation.json")
    assert [(each.name, sorted(each.effects)) for each in record.simulations] == [
        ("sim", ["com_offset", "viscous_friction"]),
        ("sim=nominal", []),
    ]
    assert record.reference == "sim"
    assert "none is better than" not in capsys.readouterr().out


def test_where_none_is_surely_better_the_next_command_is_said_to_have_the_given_one(logs, found, tmp_path, capsys):
    assert evaluate(logs, tmp_path, f"sims=[nominal,{found / 'wrong.yaml'}]") == 0
    assert "none is better than nominal by more than chance may make it in these logs" in capsys.readouterr().out


def test_a_simulation_alone_ends_with_what_could_stand_beside_it(logs, tmp_path, capsys):
    assert evaluate(logs, tmp_path) == 0
    said = capsys.readouterr().out
    assert "No other simulation stands beside it; name some by sims=[...].\n" in said
    assert "\n\n\n" not in said


def test_table_sentences_and_report_say_which_is_better_and_which_worse(logs, found, tmp_path, capsys):
    words = f"sims={{good:{found / 'augmented.yaml'},bad:{found / 'wrong.yaml'}}}"
    assert evaluate(logs, tmp_path, words) == 0
    said = capsys.readouterr().out
    assert "error of tilt after 0.16 s [rad]" in said
    row = next(line for line in said.splitlines() if line.startswith("good "))
    assert row.count("*") == 2  # the log that it was found on, and the pool
    assert (
        "good beside nominal, error of tilt after 0.16 s [rad]: better on 1, worse on 0, not told apart on 0, of 1 log "
        "that it was not found on." in said
    )
    assert "bad beside nominal, error of tilt after 0.16 s [rad]: better on 0, worse on 2" in said
    warning = next(line for line in said.splitlines() if line.startswith("bad beside"))
    assert "closes -" in warning
    assert f"next  twbal sim-collect sim={found / 'augmented.yaml'}" in said
    page = (tmp_path / "report.html").read_text()
    assert warning.split(": ", 1)[1][:40] in page
    assert (tmp_path / "figures" / "evaluation.svg").is_file()


def identified(folder, found, robot, filter_rate):
    """A run folder of identify, with a rate of the tilt's filter and its standard deviation [1/s]."""
    folder.mkdir()
    (folder / "identified.yaml").write_text((found / "augmented.yaml").read_text())
    save_distribution(folder / "robot_distribution.pt", replace(prior_of(robot), filter_rate=filter_rate))
    return folder


def test_an_identified_simulation_is_learned_with_and_its_run_folder_stands_for_it(
    logs, found, paper, tmp_path, capsys
):
    run = identified(tmp_path / "identified", found, paper, (0.1, 0.05))
    assert evaluate(logs, tmp_path / "out", f"sims={{mine:{run}}}") == 0
    said = capsys.readouterr().out
    assert "filter" not in said  # a rate that may as well be 0
    assert f"next  twbal iterate sim={run / 'identified.yaml'} known={run}\n" in said
    assert "the next command learns on a virtual robot, unless you add the link" in said


def test_an_identified_simulation_measures_the_tilt_through_the_filter_that_was_found(
    logs, found, paper, tmp_path, capsys
):
    run, errors = identified(tmp_path / "identified", found, paper, (1.2, 0.02)), {}
    text = (run / "identified.yaml").read_text()
    (tmp_path / "with_filter.yaml").write_text(f"{text}  tilt_filter: {{rate: 1.2, lead: 0.01}}\n")  # half a period
    assert evaluate(logs, tmp_path / "out", f"sims={{mine:{run},same:{tmp_path / 'with_filter.yaml'}}}") == 0
    assert f"mine measures the tilt through the filter that identify found: 1.2 1/s ({run}" in capsys.readouterr().out
    for score in read_record(SimulationEvaluation, tmp_path / "out" / "evaluation.json").scores:
        errors.setdefault(score.simulation, []).append(score.error)
    assert errors["mine"] == errors["same"]
    assert errors["mine"] != errors["nominal"]


def test_what_identify_found_of_another_robot_is_one_clear_error(logs, found, regbot, tmp_path, capsys):
    run = identified(tmp_path / "identified", found, regbot, (1.2, 0.02))
    assert evaluate(logs, tmp_path / "out", f"sims={{mine:{run}}}") == 1
    (said,) = capsys.readouterr().err.splitlines()
    assert "robot_distribution.pt" in said
    assert "regbot" in said


def test_done_work_is_not_done_again_and_other_simulations_are_other_work(logs, found, evaluated, capsys):
    before = (evaluated / "manifest.json").read_bytes()
    assert evaluate(logs, evaluated, f"sims=[nominal,{found / 'augmented.yaml'},{found / 'wrong.yaml'}]") == 0
    assert (evaluated / "manifest.json").read_bytes() == before
    assert "predictions of" not in capsys.readouterr().out
    assert evaluate(logs, evaluated, f"sims=[{found / 'augmented.yaml'}]") == 1
    assert "holds the work of other settings" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["sims=[none_such]"], "There is no simulation 'none_such'. sims takes files"),
        (["sims=[none_such.yaml]"], "There is no simulation none_such.yaml"),
        (["sims=[randomised]"], "draws another robot for each rollout"),
        (["sims={nominal:analytic,other:regbot}"], "Two simulations have the name 'nominal'"),
        (["sims=[regbot,regbot]"], "sims names regbot twice"),
        (["horizons=[30]"], "expected are 0.5 s for the filter and then 30 s for a prediction"),
        (["robot.control_period=0.01"], "control period"),
        (["robot.name=mine"], "is of the robot 'paper'; expected is 'mine'"),
    ],
)
def test_what_cannot_be_evaluated_is_refused_in_one_line(words, complaint, logs, tmp_path, capsys):
    assert evaluate(logs, tmp_path / "out", *words) == 1
    said = capsys.readouterr().err.strip()
    assert complaint in said
    assert len(said.splitlines()) == 1
    assert not (tmp_path / "out" / "evaluation.json").exists()


def test_logs_of_two_robots_are_refused(logs, paper, tmp_path, capsys):
    episode = log(paper, TRUE, 3, periods=200).episode
    other = replace(episode, provenance=Provenance("regbot", "robot"))
    write_episode(tmp_path / "other.mcap", other)
    words = [f"episodes=[{logs / 'day_1'},{tmp_path / 'other.mcap'}]", f"hydra.run.dir={tmp_path / 'out'}", *QUICK]
    assert main(["evaluate-sim", *words]) == 1
    assert "is of the robot 'regbot'; expected is 'paper'" in capsys.readouterr().err
