"""Algorithm 1 as one command, in small: what it leaves, what it says, and what it does the second time."""

import json
import re
import sys

import numpy as np
import pytest
from scipy.stats import norm
from small_run import OVERRIDES, STEPS, listed_hashes
from story import check, untimed

import twbal
from twbal.algorithm.model_file import load_model
from twbal.algorithm.prediction import load_prediction
from twbal.algorithm.summary import read_summary
from twbal.cli.composed import composed
from twbal.cli.main import main
from twbal.cli.manifest import StageWork, perform, read_manifest
from twbal.cli.stages import iterate as stage
from twbal.core.errors import ConfigError, LinkError
from twbal.core.files import file_hash
from twbal.io.logs import read_episodes
from twbal.virtual_robot.process import VirtualRobotProcess


@pytest.fixture(scope="module")
def started():
    """Commands of the virtual robots that the small run started."""
    return []


@pytest.fixture(scope="module")
def folder(tmp_path_factory, started):
    """Run folder of the small run."""
    folder = tmp_path_factory.mktemp("iterate") / "run"
    arguments, start = sys.argv, VirtualRobotProcess.__init__

    def noted(process, command):
        started.append(command)
        start(process, command)

    try:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(VirtualRobotProcess, "__init__", noted)
            assert iterate(folder) == 0
    finally:
        sys.argv = arguments
    return folder


def iterate(folder, *words):
    return main(["iterate", *OVERRIDES, f"hydra.run.dir={folder}", *words])


def test_the_summary_says_what_the_logs_say(folder):
    summary = read_summary(folder / "summary.json")
    collected = ("0_collect", "1_collect")
    simulated = [e for name in collected for e in read_episodes(folder / "simulation" / name / "episodes")]
    assert (summary.sim.episodes, summary.sim.samples) == (7, sum(map(len, simulated)))
    first, second = summary.iterations
    (driven,) = read_episodes(folder / "iteration_0/rollout/episodes")
    assert (first.real_episodes, first.real_samples, first.real_seconds) == (0, 0, 0.0)
    assert (second.real_episodes, second.real_samples) == (1, len(driven))
    assert second.real_seconds == pytest.approx(0.02 * len(driven))
    assert (first.trials, second.trials) == (2, 2)


def test_one_virtual_robot_serves_all_stages(folder, started):
    driven = [*folder.glob("iteration_*/trials/episodes"), *folder.glob("iteration_*/rollout*/episodes")]
    assert len(read_manifest(folder).outputs) and len(driven) == 3
    assert len(started) == 1


def test_the_place_is_judged_by_the_true_poses_of_the_virtual_robot(folder):
    for iteration in read_summary(folder / "summary.json").iterations:
        trials = read_episodes(folder / f"iteration_{iteration.index}/trials/episodes")
        assert all(np.isfinite(trial.poses).all() for trial in trials)
        away = [np.hypot(*trial.poses[10:21, :2].T).max() for trial in trials if len(trial) >= 10]  # from 0.2 to 0.4 s
        assert iteration.farthest_worst_m == pytest.approx(max(away))
        assert iteration.place_by == "pose"
        assert iteration.successes <= min(iteration.upright, iteration.settled, iteration.in_place, iteration.quiet)


def test_the_measures_follow_from_the_logs(folder):
    for iteration in read_summary(folder / "summary.json").iterations:
        place = folder / ("simulation/1_policy" if iteration.index == 0 else "iteration_1/policy")
        prediction = load_prediction(place / "prediction.pt")
        trials = read_episodes(folder / f"iteration_{iteration.index}/trials/episodes")
        inside, scored = [], []
        for t, state in enumerate(prediction.states[1:], start=1):
            reached = np.array([trial.states[t, :3] for trial in trials if t < len(trial.states)]).reshape(-1, 3)
            inside.append(np.abs(reached - state.mean[:3]) <= 1.96 * state.sd[:3])
            z = (reached - state.mean[:3]) / state.sd[:3]
            of_unit = z * (2.0 * norm.cdf(z) - 1.0) + 2.0 * norm.pdf(z) - 1.0 / np.sqrt(np.pi)
            scored.append(of_unit * state.sd[:3] / [0.25, 2.5, 1.0])
        assert iteration.coverage95 == pytest.approx(np.concatenate(inside).mean())
        assert iteration.crps == pytest.approx(np.concatenate(scored).mean())
        assert iteration.crps_of_trials is None  # two trials have no spread beside one left out
        assert iteration.success_probability == prediction.best.success_probability
        assert 0.0 < iteration.success_probability < 1.0
        assert iteration.predicted_cost == prediction.cost
        assert iteration.predicted_by is prediction.predictors[0].by
        assert iteration.judged_success == prediction.best.judged_success
        held = [len(t) == 20 and np.abs(t.tilt).max() <= 0.5236 and np.abs(t.tilt[10:]).max() < 0.17453 for t in trials]
        placed = [len(t) == 20 and np.hypot(*t.poses[10:, :2].T).max() <= 0.15 for t in trials]
        quiet = [len(t) == 20 and np.sqrt(np.mean(np.diff(t.commands[10:]) ** 2)) < 0.1 * 20.0 for t in trials]
        assert iteration.successes == sum(np.all([held, placed, quiet], axis=0))


def test_no_model_has_seen_a_trial(folder):
    rollout = file_hash(folder / "iteration_0/rollout/episodes/trial_000.mcap")
    assert load_model(folder / "iteration_1/model/model.pt").episodes["robot"] == [rollout]


@pytest.mark.slow
def test_the_library_comes_to_the_same_in_memory(folder):
    with twbal.connect() as plant:
        result = twbal.learn(plant, overrides=OVERRIDES)
    by_files = read_summary(folder / "summary.json")
    assert untimed(result.summary) == untimed(by_files)
    assert twbal.save_policy(folder.parent / "in_memory.pt", result.policy) == by_files.best.policy.sha256


@pytest.mark.slow
def test_after_an_update_that_failed_a_diagnosis_gives_one_more_base_in_memory_and_by_files(tmp_path):
    longer = ("real_rollout.steps=100", "min_update_time=1.6", "max_update_rollouts=8")
    words = [*OVERRIDES, "updates=2", *longer, "success.settled_tilt_limit=0.001"]  # no trial succeeds
    assert main(["iterate", *words, f"hydra.run.dir={tmp_path}"]) == 0
    by_files = read_summary(tmp_path / "summary.json")
    _, first, second = by_files.iterations
    assert list(first.log_evidences) == ["given", "identified", "none"]
    assert list(second.log_evidences) == ["given", "identified", "diagnosed", "none"]
    with twbal.connect() as plant:
        assert untimed(twbal.learn(plant, overrides=words).summary) == untimed(by_files)


def test_the_best_policy_lies_on_top(folder):
    summary = read_summary(folder / "summary.json")
    assert file_hash(folder / "best_policy.pt") == summary.best.policy.sha256
    assert (folder / summary.best.policy.path).read_bytes() == (folder / "best_policy.pt").read_bytes()
    counts = [summary.count(iteration.first_had) for iteration in summary.iterations]
    most = max(count.successes / count.trials for count in counts)
    assert summary.count(summary.best_iteration).successes / summary.count(summary.best_iteration).trials == most


def test_every_artefact_is_listed_with_its_hash(folder):
    listed = listed_hashes(folder)
    kinds = ("*.pt", "*.mcap", "identified.yaml", "evidence.json")
    made = {path.relative_to(folder).as_posix() for kind in kinds for path in folder.rglob(kind)}
    assert set(listed) == made
    assert listed == {path: file_hash(folder / path) for path in made}


def test_the_report_has_a_picture_of_each_iteration_and_the_commands(folder):
    page = (folder / "report.html").read_text()
    assert page.count('aria-label="Predicted and real states, iteration') == 2
    assert page.count("twbal real-rollout") == 3


def test_a_second_go_does_nothing_and_says_the_same(folder, capsys):
    stamps = {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.suffix in (".pt", ".mcap", ".json")}
    assert iterate(folder) == 0
    said = capsys.readouterr().out
    assert {path: path.stat().st_mtime_ns for path in stamps} == stamps
    assert f"report  {folder / 'report.html'}" in said
    assert f"policy  {folder / 'best_policy.pt'}" in said
    assert f"script  {folder / 'commands.sh'} (runs the same stages one by one)" in said
    assert "->" not in said
    searched, updated = check(folder, said)
    assert searched.searched and updated.searched  # what this kind of run is


@pytest.mark.slow
def test_what_got_lost_is_made_again_from_what_is_there_wherever_the_command_runs(folder, monkeypatch, capsys):
    listed, report = listed_hashes(folder), (folder / "report.html").read_bytes()
    summary = without_times(folder)
    (folder / "report.html").unlink()
    (folder / "iteration_1/policy/policy.pt").unlink()
    monkeypatch.chdir(folder.parent)
    assert iterate(folder.name) == 0
    assert capsys.readouterr().out.count("is there already") == STEPS - 1
    assert listed_hashes(folder) == listed
    assert read_manifest(folder).complete
    assert len((folder / "report.html").read_bytes()) == pytest.approx(len(report), rel=0.01)
    assert without_times(folder) == summary
    paths = [iteration["policy"]["path"] for iteration in summary["iterations"]]
    assert paths == ["simulation/1_policy/policy.pt", "iteration_1/policy/policy.pt"]


def without_times(folder):
    """What summary.json says, but for how long it took."""
    record = json.loads((folder / "summary.json").read_text())
    del record["wall_s"]
    for iteration in record["iterations"]:
        del iteration["fit_s"], iteration["search_s"]
    return record


def test_other_settings_are_refused_before_anything_is_done(folder, capsys):
    listed = listed_hashes(folder)
    for words in (["trials=3"], ["updates=0"], ["updates=2", "trials=3"]):
        assert iterate(folder, *words) == 1
        assert f"other settings (now new: {words[-1]}" in capsys.readouterr().err
    assert listed_hashes(folder) == listed


def run_without_work(monkeypatch, folder, *words, made="summary.json"):
    """A run of the stage whose work is nothing but a file; whether it was done."""
    done = []

    def work(cfg, chain, *_):
        (chain.root / "iteration_0").mkdir(exist_ok=True)
        (chain.root / "iteration_0" / "episode_000.mcap").write_text("a log")
        (chain.root / made).write_text(str(cfg.updates))
        done.append(cfg.updates)
        return [chain.root / made]

    monkeypatch.setattr(stage, "_learn_and_write", work)
    manifest = stage.run(composed("iterate", list(words)), folder, {}, [])
    assert manifest.complete
    return done


def test_a_finished_run_goes_on_with_more_updates_and_not_with_fewer(tmp_path, monkeypatch):
    assert run_without_work(monkeypatch, tmp_path, "updates=3") == [3]
    assert run_without_work(monkeypatch, tmp_path, "updates=3") == []
    assert run_without_work(monkeypatch, tmp_path, "updates=6") == [6]
    assert run_without_work(monkeypatch, tmp_path, "updates=6") == []
    for words in (["updates=3"], ["updates=9", "trials=3"], ["updates=9", "seed=8"]):
        with pytest.raises(ConfigError, match="is kept"):
            run_without_work(monkeypatch, tmp_path, *words)
    assert read_manifest(tmp_path).complete  # and nothing was lost by that
    assert run_without_work(monkeypatch, tmp_path, "updates=9") == [9]


def test_a_run_that_is_killed_while_it_goes_on_can_go_on_again(tmp_path, monkeypatch):
    run_without_work(monkeypatch, tmp_path, "updates=3")

    def killed(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(stage, "_learn_and_write", killed)
    with pytest.raises(KeyboardInterrupt):
        stage.run(composed("iterate", ["updates=6"]), tmp_path, {}, [])
    assert run_without_work(monkeypatch, tmp_path, "updates=6") == [6]


@pytest.mark.parametrize("driven", [False, True])
def test_a_run_that_ended_before_a_robot_was_driven_goes_on_with_another_link(driven, tmp_path, monkeypatch):
    def lost(cfg, chain, *_):
        rollout = chain.root / "iteration_0" / "rollout"
        (rollout / "episodes").mkdir(parents=True)
        (chain.root / "policy_0.pt").write_text("found in simulation")
        driving = StageWork("real-rollout", rollout, "", {}, 0)
        with pytest.raises(KeyboardInterrupt):
            perform(driving, lambda: killed(rollout / "episodes" / "trial_000.mcap"))
        raise LinkError("the robot is lost")

    def killed(episode):
        if driven:
            episode.write_text("a log")
        raise KeyboardInterrupt

    with monkeypatch.context() as patched, pytest.raises(LinkError):
        patched.setattr(stage, "_learn_and_write", lost)
        stage.run(composed("iterate", ["link.seed=2"]), tmp_path, {}, [])
    other = ["link.seed=3", 'link.overrides=["faults=light"]']
    with pytest.raises(ConfigError, match="is kept"):
        run_without_work(monkeypatch, tmp_path, *other, "seed=9")
    if driven:
        with pytest.raises(ConfigError, match=r"is kept"):
            run_without_work(monkeypatch, tmp_path, *other)
    else:
        assert len(run_without_work(monkeypatch, tmp_path, *other)) == 1
        assert (tmp_path / "policy_0.pt").is_file()


def test_a_run_whose_agent_was_trained_anew_is_not_taken_for_done(tmp_path, monkeypatch):
    agent, run = tmp_path / "agent", tmp_path / "run"
    agent.mkdir()
    (agent / "policy.pt").write_bytes(b"one")
    words = ["initial_policy=agent", f"trained_agent={agent}"]
    assert run_without_work(monkeypatch, run, *words) == [3]
    assert run_without_work(monkeypatch, run, *words) == []
    (agent / "policy.pt").write_bytes(b"another")
    with pytest.raises(ConfigError, match="other inputs"):
        run_without_work(monkeypatch, run, *words)


def test_an_agent_is_given_by_its_run_folder_or_by_its_file(tmp_path, monkeypatch):
    (tmp_path / "agent").mkdir()
    file = tmp_path / "agent" / "policy.pt"
    file.write_bytes(b"one")
    run = tmp_path / "run"
    assert run_without_work(monkeypatch, run, "initial_policy=agent", f"trained_agent={file}") == [3]
    assert run_without_work(monkeypatch, run, "initial_policy=agent", f"trained_agent={file.parent}") == []


def test_an_agent_that_is_not_there_is_refused_before_anything_is_done(tmp_path, capsys):
    (tmp_path / "other.pt").write_bytes(b"one")
    for given, what in (("nowhere", "is not there"), (tmp_path, "has no policy.pt"), (tmp_path / "other.pt", "is no")):
        words = ["initial_policy=agent", "updates=0", f"trained_agent={given}"]
        assert main(["iterate", *words, f"hydra.run.dir={tmp_path / 'run'}"]) == 1
        said = capsys.readouterr()
        assert f"{given} of trained_agent=... {what}" in said.err and "run folder of `twbal train-agent`" in said.err
        assert said.out == ""


def test_a_step_that_fails_is_named_with_its_folder(tmp_path, capsys):
    assert iterate(tmp_path, "sim_collect.rollouts=1", "sim_collect.steps=3") == 1
    printed = capsys.readouterr()
    assert re.search(r"^  took \d+\.\d s$", printed.out, re.MULTILINE)  # sim-collect, which did not fail
    lines = [line for line in printed.err.splitlines() if line.startswith("twbal: error:")]
    (line,) = lines
    assert line.startswith(f"twbal: error: fit-sim-gp in {tmp_path / 'simulation/0_model'}: Too few samples")


def test_it_says_how_to_go_on_after_an_interruption(folder, capsys):
    assert iterate(folder) == 0
    first = capsys.readouterr().out.splitlines()[0]
    assert first.startswith("If this run is interrupted, this command resumes it: twbal iterate updates=1 ")
    assert first.endswith(f" hydra.run.dir={folder}")
