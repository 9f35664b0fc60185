"""What cannot be right is refused in one line before anything runs, as seen by who types the command."""

import pytest
from hydra import compose
from omegaconf import OmegaConf

from twbal.cli.composition import composing
from twbal.cli.config_check import check_configuration
from twbal.cli.main import main
from twbal.core.errors import ConfigError

pytestmark = pytest.mark.usefixtures("as_from_a_shell")


@pytest.fixture
def refused(capfd, tmp_path):
    """Runs a command that must fail before it makes anything, and returns the one line that it says."""

    def run(*words):
        assert main(list(words)) == 1
        (said,) = [line for line in capfd.readouterr().err.splitlines() if "pybullet build time" not in line]
        assert not list(tmp_path.iterdir())
        return said.removeprefix("twbal: error: ")

    return run


def composed(stage, *words):
    with composing():
        return compose(stage.replace("-", "_"), list(words))


@pytest.mark.parametrize(
    ("stage", "word", "expected"),
    [
        ("sim-collect", "robot.body_mass=1e-300", "a number from 0.001 to 10000 [kg] (mass of all that does not turn"),
        ("sim-collect", "rollouts=1e9", "a whole number from 1 to 100000"),
        ("sim-collect", "sim.physics_step=abc", "a number from 1e-5 to 0.001 [s]"),
        ("diagnose", "held_out=1.5", "a number from 0.01 to 0.9"),
        ("iterate", "search.horizon=0", "a whole number from 1 to 100000 [control periods]"),
        ("real-rollout", "link.timeout=-1", "a number from 0.001 to 3600 [s]"),
        ("sim-collect", "tilt_limit=1.5708", "a number from 0.001 to 1.57 [rad]"),
        ("real-rollout", "tilt_limit=1.5708", "a number from 0.001 to 1.57 [rad]"),
        ("real-rollout", "tilt_limit=1e9", "a number from 0.001 to 1.57 [rad]"),
        ("iterate", "success.tilt_limit=1e9", "a number from 0.001 to 1.57 [rad]"),
        ("iterate", "initial_policy=magic", "one of: simulation, random, lqr, agent"),
        ("iterate", "model_update=magic", "one of: residual, full, linear"),
        ("export", "format=xml", "one of: csv, parquet"),
        ("lqr", "command_width=0", "a number from 0.0001 to 10000"),
        ("virtual-robot", "clock=sundial", "one of: lockstep, real_time"),
        ("real-rollout", "exploration=inf", "a number from 0 to 1"),
        ("virtual-robot", "self_stop_tilt=nan", "a number from 0.001 to 100 [rad]"),
    ],
)
def test_a_command_says_what_it_found_and_what_it_expects(stage, word, expected, refused):
    said = refused(stage, word)
    key = word.partition("=")[0]
    assert said.startswith(f"{stage} cannot have {key}=")
    assert f"; expected {expected}" in said
    assert said.endswith(f"`twbal {stage} --help` shows all settings with their ranges.")


def test_several_wrong_settings_are_told_at_once(refused):
    said = refused(
        "sim-collect", "rollouts=0", "steps=nan", "seed=-1", "robot.track=0", "workers=-1", "first_trial=1e30"
    )
    assert said.startswith("sim-collect cannot have robot.track=0;")
    assert "Wrong as well: seed, rollouts, first_trial and 2 more." in said


def test_what_a_later_stage_of_a_run_needs_is_asked_for_at_once(refused):
    assert refused("iterate", "link=serial").startswith("iterate needs link.port=...;")


@pytest.mark.parametrize("stage", ["sim-collect", "iterate"])
def test_a_physics_step_that_does_not_divide_the_control_period_comes_with_one_that_does(stage, refused):
    words = [stage, "robot.control_period=0.0142857"]
    said = refused(*words)
    advised = said.partition("; try ")[2].rstrip(".")
    assert advised.startswith("sim.physics_step=")
    check_configuration(composed(*words, advised), stage)


def test_a_diagnosis_takes_any_physics_step_as_it_shortens_it_itself():
    check_configuration(composed("diagnose", "robot.control_period=0.0142857", "episodes=e"), "diagnose")


@pytest.mark.parametrize(
    ("word", "expected"),
    [
        ("success.settled_tilt_limit=1", "settled_tilt_limit must be positive and at most tilt_limit"),
        ("state.names=[tilt,tilt]", "State channels must be distinct"),
        (
            "robot.com_height=0.3 +effect@sim.effects.rotor_inertia=rotor_inertia sim.effects.rotor_inertia.share=1.2",
            "0.99",
        ),
    ],
)
def test_rules_between_settings_are_held_before_anything_runs(word, expected, refused):
    assert expected in refused("iterate", *word.split())


def test_what_breaks_a_rule_is_refused_each_time_whatever_was_right_before(refused):
    check_configuration(composed("iterate"), "iterate")
    said = {refused("iterate", "success.settled_tilt_limit=1") for _ in range(2)}
    assert len(said) == 1
    check_configuration(composed("iterate"), "iterate")


def test_a_bad_job_of_a_sweep_fails_by_itself(capfd, tmp_path):
    assert main(["sim-collect", "-m", "steps=3", "rollouts=1", "robot.body_mass=10,nan"]) == 1
    said = capfd.readouterr().err
    assert "1 job of the sweep failed: steps=3 rollouts=1 robot.body_mass=nan (sim-collect cannot have" in said
    assert len(list(tmp_path.rglob("*.mcap"))) == 1


def test_a_class_of_ones_own_is_asked_for_finite_numbers_alone():
    cfg = composed("sim-collect", "+mine.size=-1e9", "policy._target_=mine.Policy", "policy.amplitude=7")
    check_configuration(cfg, "sim-collect")
    OmegaConf.update(cfg, "policy.amplitude", float("inf"))
    with pytest.raises(ConfigError, match=r"policy\.amplitude=inf; expected finite numbers"):
        check_configuration(cfg, "sim-collect")


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["sim.effects={dead_zone:{width:1}}"], "Add it by +effect@sim.effects.dead_zone=dead_zone."),
        (["sim={effects:{dead_zone:{width:1}}}"], "Add it by +effect@sim.effects.dead_zone=dead_zone."),
        (["sim.effects.dead_zone.width=1"], "Add it by +effect@sim.effects.dead_zone=dead_zone."),
        (["+sim.effects.dead_zone.width=1"], "an effect by its name, as in +effect@sim.effects.dead_zone="),
        (["+sim.effects.dead_zone=dead_zone"], "sim.effects.dead_zone=dead_zone; expected settings of its own"),
        (["++rollouts={a:1}"], "rollouts={...}; expected a whole number"),
        (["++policy.amplitude={}"], "policy.amplitude={}; expected a number"),
    ],
)
def test_what_is_no_value_of_a_setting_is_refused_with_what_would_be(words, expected, refused):
    assert expected in refused("sim-collect", *words)


def test_an_environment_is_refused_like_a_stage():
    from twbal.cli.environment_config import make

    with pytest.raises(ConfigError, match=r"cannot have robot\.body_mass=0"):
        make(["robot.body_mass=0"])
