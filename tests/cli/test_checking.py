"""What cannot be right is refused in one line before anything runs, as seen by who types the command."""

import pytest
from hydra import compose
from hydra.utils import instantiate
from omegaconf import OmegaConf

from twbal.cli.composition import composing
from twbal.cli.config_check import check_configuration
from twbal.cli.hydra_errors import explained
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


@pytest.mark.parametrize("period", ["0.0166667", "0.0142857", "0.0143", "0.0005"])
@pytest.mark.parametrize("stage", [["sim-collect"], ["iterate"], ["diagnose", "episodes=e"], ["virtual-robot"]])
def test_any_control_period_goes_with_any_physics_step(stage, period):
    check_configuration(composed(*stage, f"robot.control_period={period}"), stage[0])


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


def test_a_sweep_with_a_value_out_of_range_is_refused_before_its_first_job(capfd, tmp_path):
    assert main(["sim-collect", "-m", "steps=3", "rollouts=1", "robot.body_mass=10,nan"]) == 1
    said = capfd.readouterr().err
    assert "sim-collect cannot have robot.body_mass=nan; expected a number from 0.001" in said
    assert not list(tmp_path.rglob("*.mcap"))


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


SHARED = """
import numpy as np
from dataclasses import dataclass
from twbal.core.cost import Cost, ExpectedCost


@dataclass(frozen=True, eq=False)
class Shared(Cost):
    share: np.ndarray

    def at(self, state):
        return self.share.item() * min(1.0, np.sum((state / self.widths) ** 2))

    def expected_at(self, mean, covariance):
        return ExpectedCost(self.at(mean), mean, covariance)


def made(channels, widths, command_width, torque_limit):
    return None
"""


@pytest.fixture
def of_cost(tmp_path, monkeypatch):
    """The configuration of a stage whose cost is another class, with a further setting."""
    (tmp_path / "shared_cost.py").write_text(SHARED)
    monkeypatch.syspath_prepend(str(tmp_path))

    def run(target, **further):
        cfg = composed("optimise-policy", "dynamics=model.pt")
        OmegaConf.set_struct(cfg, False)
        own = {name: cfg.cost[name] for name in ("channels", "widths", "command_width", "torque_limit")}
        cfg.cost = {"_target_": target, **own, **further}
        return cfg

    return run


def test_a_cost_from_outside_may_have_further_numbers_that_no_table_lists(of_cost):
    cfg = of_cost("shared_cost.Shared.over", share=0.5)
    check_configuration(cfg, "optimise-policy")
    cost = instantiate(cfg.cost)
    assert cost.share == 0.5 and cost.numbers.share.item() == 0.5


@pytest.mark.parametrize(
    ("target", "further", "said"),
    [
        ("shared_cost.Shared.over", {}, "Shared lacks share: add `share: <number>` to the settings of the cost"),
        (
            "shared_cost.Shared.over",
            {"share": 0.5, "part": 1.0},
            "Shared has no field 'part' beside target and widths; it has share. Take part out of the settings of the "
            "cost, or add the line `part: Array` to the class, in the module shared_cost.",
        ),
        (
            "shared_cost.Shared.over",
            {"share": "half"},
            "share of Shared must be a number or an array of numbers; found",
        ),
        (
            "shared_cost.made",
            {"share": 0.5},
            "it has no entry 'share': take it out. Its entries are: channels, widths, command_width, torque_limit "
            "(shared_cost.made takes these).",
        ),
    ],
)
def test_a_further_number_of_a_cost_that_cannot_be_says_where_it_belongs(target, further, said, of_cost):
    cfg = of_cost(target, **further)
    check_configuration(cfg, "optimise-policy")
    try:
        instantiate(cfg.cost)
    except Exception as error:  # as the command line does
        assert said in str(explained(error, "optimise-policy"))
    else:
        pytest.fail("it was built")


@pytest.mark.parametrize(
    ("target", "name", "said"),
    [
        (
            "twbal.core.cost.SaturatingCost.over",
            "change",
            'SaturatingCost.over takes it, so add a line such as `Setting("cost.change", Number(0.0, 1.0), "what it '
            'means")` to COST of twbal/cli/settings/search_settings.py.',
        ),
        ("twbal.core.cost.cost_over", "share", "twbal.core.cost.cost_over does not take it either."),
    ],
)
def test_a_setting_of_a_packaged_cost_that_no_table_lists_says_where_to_add_it(target, name, said, of_cost):
    with pytest.raises(ConfigError, match=rf"has no setting 'cost\.{name}'") as caught:
        check_configuration(of_cost(target, **{name: 0.5}), "optimise-policy")
    assert str(caught.value).endswith(said)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ["sim.effects.dead_zone.widt=3"],
            "has no parameter 'widt' (did you mean 'width'?). Its parameters are: width, ",
        ),
        (
            ["sim.effects.dead_zone={x: 3}"],
            "The effect dead_zone has no parameter 'x'. Its parameters are: width, skew.",
        ),
    ],
)
def test_a_parameter_that_an_effect_does_not_have_is_told_as_such(words, said, refused):
    assert said in refused("sim-collect", "+effect@sim.effects.dead_zone=dead_zone", *words)


def test_a_parameter_of_an_effect_under_another_name_is_told_with_both(refused):
    said = refused("sim-collect", "+effect@sim.effects.stiction=dead_zone", "sim.effects.stiction.x=3")
    assert said.startswith("The effect dead_zone, which is sim.effects.stiction, has no parameter 'x'.")


def test_a_value_that_the_effect_itself_does_not_take_is_refused_with_the_range_that_it_takes(refused):
    said = refused("sim-collect", "+effect@sim.effects.dead_zone=dead_zone", "sim.effects.dead_zone.skew=1")
    assert "expected a number from -1 to below 1 (share by which it is wider forward" in said
