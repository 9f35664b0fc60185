"""An argument that cannot be meant is one clear error, before anything is done."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import twbal
from twbal.core.errors import CheckpointError, ConfigError, DataError, LinkError, LogError
from twbal.core.plant import Plant
from twbal.effects.dead_zone import DeadZone
from twbal.policies.policy import Policy
from twbal.policies.random import RandomPolicy

ROOT = Path(__file__).parents[2]
POLICY = ROOT / "data/regression/policy.pt"
EXCITED = ROOT / "data/regression/excited"


class Constant:
    """A policy that is derived from nothing."""

    def controller(self, rng):
        return lambda state: 1.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"steps": -5}, "steps must be a whole number of at least 1; found -5"),
        ({"steps": 20.5}, "steps must be a whole number of at least 1; found 20.5"),
        ({"steps": True}, "steps must be a whole number .*found True"),
        ({"trials": -2}, "trials must be a whole number of at least 1; found -2"),
        ({"trials": "3"}, "trials must be a whole number of at least 1; found '3'"),
        ({"seed": -1}, "seed must be a whole number of at least 0; found -1"),
        (
            {"effects": DeadZone(1.0)},
            r"must be a list.*found an effect alone\. Write \[DeadZone\(width=1\.0, skew=0\.0\)\]",
        ),
        ({"effects": [DeadZone]}, r"found the class DeadZone among them\. Give it its values: DeadZone\(\.\.\.\)"),
        ({"effects": ["dead_zone"]}, "found 'dead_zone' among them.*`from twbal.effects.dead_zone import DeadZone`"),
        ({"effects": "dead_zone"}, "found 'dead_zone'.*import DeadZone"),
        ({"effects": [3]}, "found 3 among them"),
        ({"effects": None}, "found None"),
        ({"policy": "paper"}, "there is no file 'paper'. Are two arguments swapped"),
        ({"policy": lambda s: 0.0}, "found the function <lambda>.*derived from twbal.policies.policy.Policy"),
        ({"policy": RandomPolicy}, r"RandomPolicy is a class: make a policy of it by RandomPolicy\(\.\.\.\)"),
        ({"policy": 3}, "must be a policy, or the path of a policy.pt; found 3"),
        ({"overrides": "updates=2"}, r"must be a list of texts; found the text 'updates=2'. Write \['updates=2'\]"),
        ({"overrides": [2]}, "must be texts such as 'updates=2'; found 2 among them"),
        ({"overrides": None}, r"must be a list such as \['updates=2'\]; found None"),
    ],
)
def test_an_argument_of_a_rollout_that_cannot_be_meant_is_one_clear_error(arguments, message):
    with pytest.raises(ConfigError, match=message):
        twbal.simulate(**arguments)


def test_robot_and_policy_that_are_swapped_are_told():
    with pytest.raises(ConfigError, match="swapped"):
        twbal.simulate(POLICY, "paper")
    with pytest.raises(ConfigError, match=r"found the parameters of the robot 'paper'. Are two arguments swapped"):
        twbal.evaluate(twbal.robot(), POLICY)


def test_numbers_of_numpy_are_whole_numbers_and_a_class_with_a_controller_is_a_policy():
    (episode,) = twbal.simulate(policy=Constant(), steps=np.int64(3), seed=np.int32(1))
    np.testing.assert_array_equal(episode.commands, 1.0)


def test_trials_need_a_policy_and_one_at_least():
    with pytest.raises(ConfigError, match="trials must be a whole number of at least 1; found 0"):
        twbal.evaluate(POLICY, trials=0)
    with pytest.raises(ConfigError, match=r"must be a policy, or the path of a policy.pt; found None"):
        twbal.evaluate(None)


@pytest.mark.parametrize(
    ("use", "word", "argument"),
    [
        (lambda words: twbal.setup("paper", words), "robot=lego", "robot"),
        (lambda words: twbal.setup(twbal.robot(), words), "++robot=lego", "robot"),
        (lambda words: twbal.connect("/dev/ttyUSB0", overrides=words), "robot=lego", "robot"),
        (lambda words: twbal.connect("/dev/ttyUSB0", overrides=words), "link.port=/dev/ttyUSB1", "port"),
        (lambda words: twbal.connect("/dev/ttyUSB0", overrides=words), "link=virtual", "port"),
        (lambda words: twbal.evaluate(POLICY, trials=1, overrides=words), "trials=3", "trials"),
        (lambda words: twbal.evaluate(POLICY, trials=1, overrides=words), "seed=5", "seed"),
        (lambda words: twbal.evaluate(POLICY, trials=1, overrides=words), "robot=lego", "robot"),
        (lambda words: twbal.simulate(steps=2, overrides=words), "trials=3", "trials"),
        (lambda words: twbal.simulate(steps=2, overrides=words), "seed=5", "seed"),
        (lambda words: twbal.diagnose(EXCITED, overrides=words), "episodes=elsewhere", "episodes"),
        (lambda words: twbal.diagnose(EXCITED, overrides=words), "test_episodes=[elsewhere]", "test_episodes"),
        (lambda words: twbal.evaluate_simulation({}, EXCITED, overrides=words), "sims={a: b.yaml}", "simulations"),
        (lambda words: twbal.evaluate_simulation({}, EXCITED, overrides=words), "episodes=elsewhere", "episodes"),
    ],
)
def test_an_override_of_what_is_an_argument_is_refused(use, word, argument):
    with pytest.raises(
        ConfigError, match=rf"has no argument for; found '{re.escape(word)}'\. Give {argument}=\.\.\. to"
    ):
        use(["success.duration=2", word])


def test_values_of_the_robot_and_of_the_link_may_be_among_the_overrides():
    assert twbal.setup("paper", ["robot.body_mass=12"]).simulation.robot.body_mass == 12.0
    assert twbal.setup("paper", ["seed=5", "trials=3"]).algorithm.seed == 5
    with twbal.connect(overrides=["link=virtual", "link.seed=3"]) as plant:
        assert plant.robot_name == "paper"


def test_effects_of_a_plant_are_not_left_out_in_silence():
    with twbal.setup().simulation.plant(seed=0) as plant, pytest.raises(ConfigError, match="here a plant is driven"):
        twbal.evaluate(POLICY, plant=plant, effects=[DeadZone(1.0)])


def test_what_is_no_plant_is_told():
    with pytest.raises(ConfigError, match=r"plant must be a robot to drive.*found 'paper'. Are two arguments swapped"):
        twbal.learn("paper", None)
    with pytest.raises(ConfigError, match="a connection that is not open yet"):
        twbal.learn(twbal.connect())
    with pytest.raises(ConfigError, match=r"plant must be a robot to drive.*found 3"):
        twbal.evaluate(POLICY, plant=3)


def test_a_plant_that_was_closed_is_no_robot_whose_motors_may_be_on():
    with twbal.connect() as plant:
        pass
    for drive in (lambda: twbal.evaluate(POLICY, plant=plant, trials=1), lambda: twbal.learn(plant)):
        with pytest.raises(LinkError, match=r"This plant was closed.* Connect anew") as caught:
            drive()
        assert "MAY STILL BE ON" not in str(caught.value)
    with twbal.setup().simulation.plant(seed=0) as simulated:
        pass
    with pytest.raises(LinkError, match=r"This simulated plant was closed.* Make another one"):
        twbal.evaluate(POLICY, plant=simulated, trials=1)


def test_what_a_set_up_would_overrule_is_told():
    setup = twbal.setup()
    with setup.simulation.plant(seed=0) as plant:
        with pytest.raises(ConfigError, match=r"progress must be a function .*found True"):
            twbal.learn(plant, setup=setup, progress=True)
        with pytest.raises(ConfigError, match=r"overrides=\['updates=3'\] would not act beside a set-up"):
            twbal.learn(plant, "paper", ["updates=3"], setup=setup)
        with pytest.raises(ConfigError, match="The robot is 'regbot', and the set-up is of 'paper'"):
            twbal.learn(plant, "regbot", setup=setup)
        heavy = twbal.setup(replace(twbal.robot(), name="heavy", body_mass=11.0))
        for paper in ("paper", twbal.robot("paper")):
            with pytest.raises(ConfigError, match="The robot is 'paper', and the set-up is of 'heavy'"):
                twbal.learn(plant, paper, setup=heavy)
        with pytest.raises(ConfigError, match=r"setup must be what twbal.setup\(\.\.\.\) returns; found a dict"):
            twbal.learn(plant, setup={})


def test_a_value_of_a_robot_with_a_unit_is_told():
    with pytest.raises(ConfigError, match=r"body_mass of robot 'paper' must be a number.*found '11 kg'"):
        replace(twbal.robot(), body_mass="11 kg")
    with pytest.raises(ConfigError, match=r"com_offset of robot 'paper' must be a number.*found None"):
        replace(twbal.robot(), com_offset=None)


def test_a_diagnosis_and_an_evaluation_of_simulations_take_paths():
    with pytest.raises(LogError, match="there_is_none is not there"):
        twbal.diagnose("there_is_none")
    with pytest.raises(LogError, match="there_is_none is not there"):
        twbal.diagnose([EXCITED], test_episodes="there_is_none")
    quick = ["horizons=[0.15]"]
    by_path = twbal.evaluate_simulation({}, EXCITED, overrides=quick)
    by_value = twbal.evaluate_simulation({}, twbal.read_episodes(EXCITED), overrides=quick)
    assert by_path.score("nominal", "all logs", "tilt", 0.16) == by_value.score("nominal", "all logs", "tilt", 0.16)


@pytest.mark.parametrize("use", [twbal.diagnose, lambda episodes: twbal.evaluate_simulation({}, episodes)])
def test_what_is_no_list_of_episodes_is_told(use):
    (episode,) = twbal.simulate(steps=2)
    with pytest.raises(ConfigError, match=r"a list of episodes, or paths.*found an Episode, which is no list"):
        use(episode)
    with pytest.raises(ConfigError, match="found 3 among them"):
        use([3])
    with pytest.raises(ConfigError, match="found None, which is no list"):
        use(None)


def test_simulations_need_names():
    with pytest.raises(ConfigError, match=r"files or choices by name.*found 'augmented.yaml'"):
        twbal.evaluate_simulation("augmented.yaml", EXCITED)


def test_what_no_file_can_hold_is_told(tmp_path):
    policy = RandomPolicy(0.1, 20.0, hold=1)
    assert isinstance(policy, Policy)
    with pytest.raises(ConfigError, match=r"one that a file can hold \(RbfPolicy, .*found a RandomPolicy"):
        twbal.save_policy(tmp_path / "policy.pt", policy)
    for own in (policy, Constant()):
        with pytest.raises(ConfigError, match=rf"one that a file can hold \(RbfPolicy, .*found a {type(own).__name__}"):
            twbal.export_policy(own, tmp_path / "ex")
    assert not (tmp_path / "ex").exists()
    with pytest.raises(ConfigError, match="distil must be a whole number of at least 0; found -1"):
        twbal.export_policy(POLICY, tmp_path, distil=-1)
    with pytest.raises(ConfigError, match="found 3 among them"):
        twbal.read_episodes([3])


@pytest.mark.parametrize(("value", "found"), [(None, "found None"), ([POLICY], "found a list"), (3, "found 3")])
def test_what_is_no_path_is_told(value, found):
    policy = twbal.load_policy(POLICY)
    for use, of in (
        (lambda path: twbal.load_policy(path), "path must be the path of a policy.pt"),
        (lambda path: twbal.load_model(path), "path must be the path of a model.pt"),
        (lambda path: twbal.save_policy(path, policy), "path must be the path of the policy.pt to write"),
        (lambda path: twbal.export_policy(policy, path), "folder must be the path of the folder to write into"),
    ):
        with pytest.raises(ConfigError, match=f"{of}; {found}"):
            use(value)
    if value is None:
        with pytest.raises(ConfigError, match=r"paths must be the path of a log or of a folder .*; found None"):
            twbal.read_episodes(value)


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["model.kernel=matern5", "search=particles"], "there is no kernel 'matern5'"),
        (["model.kernel=matern52"], "Search by particles, with search=particles"),
    ],
)
def test_a_kernel_that_cannot_be_learned_or_searched_is_refused_with_the_set_up(overrides, message):
    with pytest.raises(ConfigError, match=message):
        twbal.setup("paper", overrides)


def test_a_kernel_that_can_be_searched_is_set_up():
    setup = twbal.setup("paper", ["model.kernel=matern52+linear", "search=particles"])
    assert setup.models.recipe.kernel == "matern52+linear"


def test_an_evaluation_of_no_episode_is_an_error():
    with pytest.raises(DataError, match=r"An evaluation needs at least one episode; found none\."):
        twbal.evaluate_simulation({}, [])


@pytest.fixture(scope="module")
def evaluated():
    """The nominal simulation, by two names more, beside another one, on one log."""
    simulations = {"mine": "nominal", "nominal": "nominal", "other": "regbot", "again": "nominal"}
    log = next(iter(sorted(EXCITED.glob("*.mcap"))))
    return twbal.evaluate_simulation(simulations, log, overrides=["horizons=[0.15]"])


def test_a_simulation_keeps_the_name_that_it_was_given(evaluated):
    assert [each.name for each in evaluated.simulations] == ["nominal", "mine", "other", "again"]
    nominal, mine, other = (evaluated.score(name, "all logs", "tilt", 0.16) for name in ("nominal", "mine", "other"))
    assert (mine.simulation, mine.error, mine.ratio) == ("mine", nominal.error, 1.0)
    assert other.error != nominal.error


def test_of_a_single_log_all_logs_are_that_log(evaluated):
    (name,) = evaluated.columns
    assert evaluated.score("mine", "all logs", "tilt", 0.16) == evaluated.score("mine", name, "tilt", 0.16)
    assert evaluated.score("mine", name, "tilt", 0.1 + 0.06) is not None


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"simulation": "yours"}, "no simulation 'yours'. It has: nominal, mine, other, again"),
        ({"log": "trial_9"}, "no log 'trial_9'. It has: .*trial_000"),
        ({"channel": "titl"}, "no channel 'titl'. It has: tilt, tilt_rate, wheel_angle, wheel_rate"),
        ({"horizon": 0.15}, r"no horizon 0.15. It has: 0.16"),
    ],
)
def test_a_score_by_a_name_that_there_is_not_lists_those_that_there_are(evaluated, changed, message):
    asked = {"simulation": "mine", "log": "all logs", "channel": "tilt", "horizon": 0.16}
    with pytest.raises(ConfigError, match=message):
        evaluated.score(**{**asked, **changed})


def test_a_score_of_a_channel_that_was_not_measured_is_none(evaluated):
    kept = tuple(score for score in evaluated.scores if score.channel != "wheel_rate")
    assert replace(evaluated, scores=kept).score("mine", "all logs", "wheel_rate", 0.16) is None


def test_a_recording_that_is_given_twice_is_a_warning(tmp_path):
    log, other = sorted(EXCITED.glob("*.mcap"))[:2]
    copy = tmp_path / "copy.mcap"
    copy.write_bytes(log.read_bytes())
    with pytest.warns(UserWarning, match=r"copy\.mcap is the same recording as .*trial_000\.mcap: it counts twice"):
        assert len(twbal.read_episodes([log, other, copy])) == 3
    (episode,) = twbal.simulate(steps=3)
    for use, said in (
        (lambda: twbal.evaluate_simulation({}, [episode, episode]), "episode 1 is the same recording as episode 0"),
        (lambda: twbal.diagnose([episode, episode]), "episode 1 is the same recording as episode 0"),
        (lambda: twbal.diagnose([episode], test_episodes=[episode]), "test episode 0 is the same recording as episode"),
    ):
        with pytest.warns(UserWarning, match=said), pytest.raises(DataError):  # it is too short for both
            use()
    assert len(twbal.read_episodes([log, other])) == 2


class Unmade(Plant):
    """Never driven."""

    control_period = 0.02

    def reset(self, trial):
        raise AssertionError

    step = stop = close = reset


def test_the_class_of_a_plant_is_no_plant():
    for drive in (lambda: twbal.evaluate(POLICY, plant=Unmade), lambda: twbal.learn(Unmade)):
        with pytest.raises(ConfigError, match=r"Unmade is a class: make one by Unmade\(\.\.\.\)"):
            drive()


def test_what_cannot_be_told_is_refused_before_the_first_trial():
    with pytest.raises(ConfigError, match=r"tell must be a function of an episode, .*; found 3"):
        twbal.evaluate(POLICY, plant=Unmade(), tell=3)


@pytest.mark.parametrize(
    ("use", "word", "said"),
    [
        (twbal.simulate, "updates=2", "twbal.simulate does not read 'updates=2'; it reads robot, sim, start, state"),
        (twbal.simulate, "success=sticky", "does not read 'success=sticky'"),
        (twbal.simulate, "link.seed=2", r"`with twbal\.connect\(port, robot, \['link\.seed=2'\]\) as plant:`"),
        (lambda **more: twbal.simulate(policy=POLICY, **more), "policy=excite", "does not read 'policy=excite'"),
        (lambda **more: twbal.evaluate(POLICY, **more), "updates=2", "twbal.evaluate does not read 'updates=2'"),
        (lambda **more: twbal.evaluate(POLICY, **more), "link.seed=2", r"a virtual one, write `with twbal\.connect"),
        (lambda **more: twbal.evaluate(POLICY, **more), "search.iterations=2", "success, cost, search.horizon"),
        (
            lambda **more: twbal.evaluate(POLICY, plant=Unmade(), **more),
            "link.seed=2",
            r"Give it to what makes the plant: twbal\.connect\(port, robot, \['link\.seed=2'\]\)",
        ),
        (lambda **more: twbal.evaluate(POLICY, **more), "updatess=2", "no setting 'updatess'"),
    ],
)
def test_a_setting_that_nothing_there_reads_is_refused(use, word, said):
    with pytest.raises(ConfigError, match=said):
        use(overrides=[word])


def test_settings_that_a_simulation_reads_are_taken():
    words = ["+effect@sim.effects.dead_zone=dead_zone", "state=paper", "start.tilt_mean=0.01", "policy=random"]
    assert len(twbal.simulate(steps=2, overrides=[*words, "experiment=paper"])) == 1


def test_a_policy_of_the_settings_that_cannot_be_read_is_an_error_of_twbal(tmp_path):
    with pytest.raises(CheckpointError, match="There is no checkpoint"):
        twbal.simulate(overrides=["policy=saved", f"policy.path={tmp_path / 'none.pt'}"])


@pytest.mark.parametrize(("duration", "steps"), [(0.5, 25), (1.98, 99)])
def test_trials_that_end_before_the_horizon_of_their_cost_are_refused(duration, steps):
    shorter = [f"success.duration={duration}", "success.place_time=0", "success.settle_time=0"]
    with pytest.raises(ConfigError, match=rf"success\.duration of {steps} control periods and search\.horizon=100"):
        twbal.evaluate(POLICY, overrides=shorter)
    assert twbal.setup("paper", [*shorter, f"search.horizon={steps}"]).rule.steps == steps
    setup = twbal.setup("paper")
    with pytest.raises(ConfigError, match=r"search\.horizon=100"):
        replace(setup, rule=replace(setup.rule, steps=99, settle_step=0, place_step=0))


def test_a_seed_that_is_out_of_range_is_named_as_it_was_given():
    with pytest.raises(ConfigError, match=r"cannot have seed=4294967296; .*Wrong as well: sim_collect\.seed"):
        twbal.setup("paper", ["seed=4294967296"])


def test_a_folder_of_own_choices_that_is_not_there_is_told():
    with pytest.raises(
        ConfigError, match=r"hydra\.searchpath=\[\.\.\.\] names the folder /nonexist, which is not there"
    ):
        twbal.setup("paper", ["hydra.searchpath=[/nonexist]"])


def test_simulations_may_have_any_name():
    names = ["my sim, v=1", "null", "1", "simulation_0", "{a: 'b'}", ""]
    log = next(iter(sorted(EXCITED.glob("*.mcap"))))
    found = twbal.evaluate_simulation(dict.fromkeys(names, "nominal"), log, overrides=["horizons=[0.15]"])
    assert [each.name for each in found.simulations] == ["nominal", *names]
    assert found.score(names[0], "all logs", "tilt", 0.16).ratio == 1.0


def test_a_model_names_the_channels_that_it_needs():
    model = twbal.load_model(ROOT / "data/regression/model.pt")
    for states, commands in ((np.zeros(5), 0.0), (np.zeros((3, 4)), np.zeros(3)), (np.zeros((3, 5)), np.zeros(2))):
        for step in (model.step_mean, model.step_distribution):
            with pytest.raises(
                DataError, match=r"shape \(m, 5\), with the channels tilt, tilt_rate, speed, command_1, c"
            ):
                step(states, commands)
    assert model.step_mean([[0.0] * 5], [0.0]).shape == (1, 5)


@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_a_robot_with_numbers_of_numpy_is_one_of_python(kind):
    given = replace(twbal.robot(), name="heavy", body_mass=kind(11.0))
    assert twbal.setup(given).simulation.robot.body_mass == 11.0
