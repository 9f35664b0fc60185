"""What a stage prints as the next command is run as it is printed, by way of a shell, in folders with blanks."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from how_to_run import SMALL
from scratch import DATA, regbot_log

from twbal.cli.main import main
from twbal.io.logs import read_episodes

OTHER = ("robot.body_mass=9", "state=paper")  # than the defaults: a next command must hand these on


@pytest.fixture
def follow(tmp_path, monkeypatch, capsys):
    """Runs a command, and returns the words of the next one as a shell reads them."""
    monkeypatch.setattr(sys, "argv", ["twbal"])
    monkeypatch.chdir(tmp_path)

    def run(stage, *words, small=None):
        assert main([stage, *words, *(SMALL.get(stage, ()) if small is None else small)]) == 0, (stage, words)
        (line,) = [line for line in capsys.readouterr().out.splitlines() if line.startswith("next")]
        command = line.removeprefix("next").strip()
        shell = 'twbal() { printf "%s\\n" "$@"; }; ' + command
        return subprocess.run(["sh", "-euc", shell], capture_output=True, text=True, check=True).stdout.splitlines()

    return run


@pytest.mark.slow
def test_from_simulation_to_a_correction_each_next_command_runs(follow):
    following = follow("sim-collect", *OTHER, "rollouts=4", "hydra.run.dir=my runs/1 simulation", small=("steps=20",))
    for stage, out in (
        ("fit-sim-gp", "2 f"),
        ("optimise-policy", "3 policy"),
        ("real-rollout", "4 real"),
        ("fit-diff-gp", "5 g"),
        ("optimise-policy", "6 policy"),
        ("real-rollout", "7 real"),
    ):
        assert following[0] == stage
        assert set(OTHER) <= set(following)
        small = () if stage == "fit-diff-gp" else SMALL[stage]
        more = ("model.smoothing=null", "model.fit_g.settings.starts=1") if stage == "fit-diff-gp" else ()
        following = follow(*following, *more, f"hydra.run.dir=my runs/{out}", small=small)
    (episode,) = read_episodes(Path("my runs/7 real/episodes"))
    assert list(episode.channels) == ["tilt", "tilt_rate", "acceleration"]


def test_after_shaking_the_robot_comes_the_diagnosis(follow):
    words = ["experiment=excite", "robot=regbot", "link.seed=7", "trials=1", "hydra.run.dir=my runs/shaken"]
    following = follow("real-rollout", *words, small=())
    assert following == ["diagnose", "episodes=my runs/shaken", "robot=regbot", "sim=regbot"]
    assert main([*following, "--cfg", "job"]) == 0


def test_after_trials_that_are_too_short_for_a_diagnosis_comes_identify(follow):
    words = ("experiment=excite", "robot=regbot", "link.seed=7", "hydra.run.dir=my runs/shaken")
    following = follow("real-rollout", *words, small=("trials=1", "steps=60"))
    assert following == ["identify", "episodes=my runs/shaken", "robot=regbot", "sim=regbot"]
    assert main([*following, "--cfg", "job"]) == 0


def test_what_an_experiment_sets_of_the_robot_is_handed_on(follow):
    experiment = Path("my_conf", "experiment", "mine.yaml")
    experiment.parent.mkdir(parents=True)
    experiment.write_text("# @package _global_\nrobot: {body_mass: 11.0, track: 0.5}\ntrials: 1\nsteps: 60\n")
    words = ("experiment=mine", "--config-dir=my_conf", "policy=excite", "robot.track=0.6", "hydra.run.dir=out")
    following = follow("real-rollout", *words, small=())
    assert following[-2:] == ["robot.track=0.6", "robot.body_mass=11.0"]
    assert main([*following, "--cfg", "job"]) == 0


def test_after_trials_that_tell_nothing_the_robot_is_recorded_again_by_the_same_link(follow):
    words = ("experiment=excite", "robot=regbot", "link.seed=7", "hydra.run.dir=my runs/shaken")
    following = follow("real-rollout", *words)
    gently = ["experiment=excite", "policy.command_width=0.1"]
    assert following == ["real-rollout", *gently, "robot=regbot", "link.seed=7"]


@pytest.mark.slow
def test_a_diagnosis_ends_with_a_command_that_takes_its_simulation(follow):
    shutil.copytree(DATA / "excited", "my logs")
    enough = ("horizons=[0.15]", "starts=10")
    following = follow("diagnose", "episodes=my logs", "robot.body_mass=9", "hydra.run.dir=my runs/d", small=enough)
    assert following == ["sim-collect", "sim=my runs/d/augmented.yaml", "robot.body_mass=9"]
    follow(*following)


@pytest.mark.slow
def test_a_diagnosis_without_a_finding_ends_with_a_command_that_records_again(follow):
    shutil.copytree(DATA / "real", "my logs")
    following = follow("diagnose", "episodes=my logs", "robot.body_mass=9", "hydra.run.dir=my runs/d")
    assert following == ["real-rollout", "experiment=excite", "policy.command_width=0.1", "robot.body_mass=9"]
    follow(*following)


def test_recovered_logs_can_be_shown(follow):
    shutil.copytree(DATA / "real", "my logs")
    following = follow("repair", "logs=my logs", "hydra.run.dir=what is left")
    assert following == ["plot", "episode=what is left/episodes/trial_000.mcap", "simulate=false", "film=false"]


def test_imported_logs_are_diagnosed_as_measured_ones(follow):
    Path("my ride.txt").write_text(regbot_log())
    following = follow("import-log", "import=regbot", "robot=regbot", "files=[my ride.txt]", "hydra.run.dir=my runs/i")
    assert following == ["diagnose", "episodes=my runs/i", "diagnosis=real_logs", "robot=regbot", "sim=regbot"]
    assert main([*following, "--cfg", "job"]) == 0
