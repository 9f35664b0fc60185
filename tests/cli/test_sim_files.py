"""A simulation may come from a file, and from a stranger: it is data, it replaces the one chosen, and it is bounded."""

import os
import pickle
import warnings
from pathlib import Path

import pytest
from hydra import compose
from omegaconf import OmegaConf

from twbal.cli.commands import text
from twbal.cli.composed import composed
from twbal.cli.composition import composing
from twbal.cli.main import main
from twbal.cli.sim_files import as_given, simulation_text, with_files
from twbal.core.errors import ConfigError
from twbal.diagnosis.inputs import DiagnosedSimulation
from twbal.effects.library import nodes

GAIN = "physics_step: 0.0005\neffects:\n  torque_gain: {gain: 0.8}\n"
EARLIER = """
physics_step: 0.0005
effects:
  torque_gain:
    _target_: twbal.effects.torque_gain.TorqueGain
    gain: 0.8
"""


@pytest.fixture
def gain(tmp_path):
    path = tmp_path / "it's new" / "augmented.yaml"
    path.parent.mkdir()
    path.write_text(GAIN)
    return path


def simulation(*words, stage="sim_collect"):
    """The simulation that a stage runs with."""
    with composing():
        return OmegaConf.to_container(compose(stage, with_files(words)).sim)


JUST_GAIN = {
    "physics_step": 0.0005,
    "effects": {"torque_gain": {"_target_": "twbal.effects.torque_gain.TorqueGain", "gain": 0.8}},
}


@pytest.mark.parametrize("content", [GAIN, EARLIER])
def test_a_stage_takes_the_simulation_that_a_file_says(content, gain):
    gain.write_text(content)
    assert simulation(f"sim={gain}") == JUST_GAIN


def test_a_path_in_quotes_is_read_as_hydra_reads_it(gain):
    assert "\\'" in text(str(gain))
    assert simulation(f"sim={text(str(gain))}") == JUST_GAIN


def test_the_command_line_takes_it(gain, capsys):
    assert main(["sim-collect", f"sim={gain}", "--cfg", "job"]) == 0
    said = capsys.readouterr().out
    assert "physics_step: 0.0005" in said
    assert "_target_: twbal.effects.torque_gain.TorqueGain\n      gain: 0.8" in said


@pytest.mark.parametrize("before", ["sim=regbot", "sim=randomised", "sim=analytic", "sim={other}", "sim={itself}"])
def test_the_file_replaces_the_simulation_that_another_word_chose(before, gain, tmp_path):
    (tmp_path / "other.yaml").write_text("effects: {dead_zone: {width: 1}, torque_gain: {gain: 2}}")
    before = before.format(other=tmp_path / "other.yaml", itself=gain)
    assert simulation(before, "robot=regbot", f"sim={gain}") == JUST_GAIN


def test_a_file_among_several_simulations_is_refused_before_anything_is_made(gain, tmp_path, capsys):
    several = f"sim=nominal,{text(str(gain))}"
    assert main(["sim-collect", "-m", several]) == 1
    said = capsys.readouterr().err
    assert "names several simulations, one of them by its file" in said
    assert f"Run the command once for each: with sim=nominal, then with sim={text(str(gain))}." in said
    assert not list(tmp_path.rglob("multirun.yaml"))
    with pytest.raises(ConfigError, match="names several simulations"):
        with_files(["sim=nominal," + text(str(gain.parent))])
    comma = gain.rename(gain.with_name("a,b.yaml"))
    assert simulation(f"sim={comma}") == JUST_GAIN


def test_the_simulation_that_is_chosen_last_counts(gain):
    assert simulation(f"sim={gain}", "sim=regbot") == simulation("sim=regbot")


def test_a_file_without_effects_has_none(tmp_path):
    (tmp_path / "clean.yaml").write_text("physics_step: 0.001\neffects:\n")
    assert simulation("sim=regbot", f"sim={tmp_path / 'clean.yaml'}") == {"physics_step": 0.001, "effects": {}}


def test_other_words_change_its_values_wherever_they_stand(gain):
    expected = {"_target_": "twbal.effects.torque_gain.TorqueGain", "gain": 0.7}
    for words in (
        [f"sim={gain}", "sim.effects.torque_gain.gain=0.7"],
        ["sim.effects.torque_gain.gain=0.7", f"sim={gain}"],
    ):
        assert simulation(*words)["effects"] == {"torque_gain": expected}
    more = simulation(f"sim={gain}", "+effect@sim.effects.dead_zone=dead_zone")
    assert set(more["effects"]) == {"torque_gain", "dead_zone"}


def test_an_effect_that_is_added_twice_is_refused(gain):
    with pytest.raises(ConfigError, match="has torque_gain already; change its values by"):
        with_files([f"sim={gain}", "+effect@sim.effects.torque_gain=torque_gain"])


def test_other_words_are_left_as_they_are():
    words = ["sim=nominal", "sim.physics_step=0.001", "policy.path=sim.yaml", "-m"]
    assert with_files(words) == words


def test_a_simulation_of_another_robot_is_doubted(tmp_path):
    """It is not refused: a sheet may have been given another name."""
    (tmp_path / "a.yaml").write_text(simulation_text({}, 0.001, "regbot", "of REGBOT"))
    word = f"sim={tmp_path / 'a.yaml'}"
    with pytest.warns(UserWarning, match="was made for robot 'regbot', and this robot is 'paper'"):
        composed("sim-collect", [word])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        composed("sim-collect", [word, "robot=regbot"])
        composed("sim-collect", ["sim=nominal"])


def test_what_diagnose_writes_comes_back_whatever_the_effect(tmp_path, paper):
    present = {"sensor_noise": dict.fromkeys(["tilt", "tilt_rate", "acceleration", "wheel_angle", "wheel_rate"], 1e-5)}
    present["sensor_noise"]["yaw_rate"] = 0.0
    found = DiagnosedSimulation(paper, {**present, "dead_zone": {"width": 1.2}}, 0.001)
    (tmp_path / "a.yaml").write_text(simulation_text(found.effects, found.physics_step, found.robot.name, "named"))
    assert "_target_" not in (tmp_path / "a.yaml").read_text()
    effects = simulation(f"sim={tmp_path / 'a.yaml'}")["effects"]
    assert effects["dead_zone"] == {"_target_": "twbal.effects.dead_zone.DeadZone", "width": 1.2}
    assert effects["sensor_noise"].pop("_target_") == "twbal.effects.sensor_noise.SensorNoise"
    assert effects["sensor_noise"] == present["sensor_noise"]


def test_every_choice_of_an_effect_is_a_simulation_file_as_well(tmp_path):
    for name, node in nodes().items():
        (tmp_path / "one.yaml").write_text(OmegaConf.to_yaml({"effects": {name: node}}))
        assert with_files([f"sim={tmp_path / 'one.yaml'}"]) == ["sim=nominal", f"++sim.effects.{name}={text(node)}"]


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ConfigError, match=r"There is no simulation .*gone\.yaml"):
        with_files([f"sim={tmp_path / 'gone.yaml'}"])


def bomb(deep: int) -> str:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, deep)]
    return "\n".join(lines)


def dead_zone(values: str) -> str:
    return f"effects: {{dead_zone: {values}}}"


CLASS = "twbal.effects.dead_zone.DeadZone"
HOSTILE = {
    "a shell command by sympy": (
        "effects:\n  a:\n    _target_: sympy.sympify\n    a: \"__import__('os').system('touch {canary}')\"",
        "there is no effect 'a'",
    ),
    "sympy under a known name": (
        "effects:\n  dead_zone:\n    _target_: sympy.sympify\n    a: \"__import__('os').system('touch {canary}')\"",
        f"_target_ of dead_zone must be {CLASS}, or be left out; found 'sympy.sympify'",
    ),
    "a file overwritten": (
        "effects:\n  dead_zone:\n    _target_: pathlib.Path.write_text\n"
        "    self: {_target_: pathlib.Path, _args_: ['{canary}']}\n    data: x",
        "found 'pathlib.Path.write_text'",
    ),
    "the process ended": ("effects: {dead_zone: {_target_: os._exit, status: 0}}", "found 'os._exit'"),
    "another effect's class": (
        "effects: {dead_zone: {_target_: twbal.effects.torque_gain.TorqueGain, gain: 1}}",
        f"must be {CLASS}",
    ),
    "_partial_": (dead_zone("{_partial_: true, width: 1}"), "has the values width, skew; found '_partial_', 'width'"),
    "_args_": (dead_zone("{_args_: [1]}"), "has the values width, skew; found '_args_'"),
    "a target within": (
        dead_zone("{width: {_target_: os.system, command: touch {canary}}}"),
        "dead_zone.width must be a plain number",
    ),
    "a target that is no text": (dead_zone("{_target_: [os.system], width: 1}"), f"must be {CLASS}"),
    "a variable of the shell": (dead_zone("{width: '${oc.env:HOME}'}"), "found '${oc.env:HOME}'"),
    "a target by a variable": (dead_zone("{_target_: '${oc.env:HOME}', width: 1}"), f"must be {CLASS}"),
    "a key that is an override": ("effects: {'dead_zone=1 hydra.run.dir': {width: 1}}", "there is no effect"),
    "an anchor": ("effects: &e {dead_zone: {width: 1}}", "has an anchor or an alias"),
    "a billion laughs": (bomb(12).replace("{", "{"), "has an anchor or an alias"),
    "a merge key": ("effects: {dead_zone: {<<: {width: 1}}}", "has a merge key"),
    "a tag of python": (
        "effects: !!python/object/apply:os.system ['touch {canary}']",
        "has the tag 'tag:yaml.org,2002:python/object/apply:os",
    ),
    "a tag": ("effects: {dead_zone: {width: !!float 1}}", "has the tag"),
    "a million keys": ("".join(f"k{k}: 1\n" for k in range(10**6)), "it has more than 65536 bytes"),
    "many keys": ("".join(f"k{k}: 1\n" for k in range(5000)), "holds too much"),
    "ten thousand levels": ("[" * 10**4, "holds too much"),
    "ten thousand levels of mappings": ("{a: " * 10**4, "holds too much"),
    "ten thousand indented levels": ("- " * 10**4, "holds too much"),
    "a key twice": ("effects: {dead_zone: {width: 1, width: 2}}", "has 'width' twice, in line 1"),
    "an effect twice": (
        "effects:\n  dead_zone: {width: 1}\n  dead_zone: {width: 2}",
        "has 'dead_zone' twice, in line 3",
    ),
    "__class__": ("effects: {__class__: {width: 1}}", "there is no effect '__class__'"),
    "__init__ among the values": (dead_zone("{width: 1, __init__: 2}"), "found 'width', '__init__'"),
    "a module that is no effect": ("effects: {library: {}}", "there is no effect 'library'"),
    "an abstract effect": ("effects: {effect: {}}", "there is no effect 'effect'"),
    "a key that is a list": ("effects: {? [a] : 1}", "has a key that is no text"),
    "a list": ("- 1", "is no simulation: it is a list; expected physics_step, effects, robot"),
    "a word": ("dead_zone", "is no simulation: it is a str"),
    "another part": ("robots: 3\neffects: {}", "it has 'robots', 'effects'; expected physics_step, effects, robot"),
    "an engine": ("engine: planar", "it has 'engine'"),
    "effects that are a number": ("effects: 3", "effects must be a mapping of names; found '3'"),
    "effects that are a list": ("effects: [dead_zone]", "effects must be a mapping of names"),
    "nothing": ("", "is empty"),
    "a comment": ("# nothing", "is empty"),
    "two documents": ("effects: {}\n---\neffects: {}", "holds several documents"),
    "no yaml": ("a: [", "is no yaml that can be read"),
    "an impossible character": ('a: "\\UFFFFFFFF"', "is no yaml that can be read"),
    "a value missing": (dead_zone("{}"), "dead_zone has the values width, skew; found nothing"),
    "a value too many": (dead_zone("{width: 1, depth: 2}"), "has the values width, skew; found 'width', 'depth'"),
    "nan": (dead_zone("{width: .nan}"), "dead_zone.width must be a plain number within ±1e+06; found '.nan'"),
    "inf": (dead_zone("{width: .inf}"), "found '.inf'"),
    "true": (dead_zone("{width: true}"), "found 'true'"),
    "null": (dead_zone("{width: null}"), "found 'null'"),
    "a huge number": (dead_zone("{width: 1e300}"), "found '1e300'"),
    "an endless number": (dead_zone("{width: " + "9" * 5000 + "}"), "must be a plain number"),
    "a size that cannot be": (dead_zone("{width: -1}"), "width of effect DeadZone must lie within [0, inf)"),
    "a delay of days": ("effects: {imu_delay: {delay: 1e5}}", "delay of effect ImuDelay must lie within [0, 10)"),
    "a delay of the command": ("effects: {actuation_delay: {delay: 1e5}}", "must lie within [0, 10)"),
    "no step": ("physics_step: 0", "physics_step must be a number from 1e-5 to 0.001 [s]; found 0.0"),
    "a step that is a word": ("physics_step: abc", "physics_step must be a plain number"),
    "steps without end": ("physics_step: 1e-300", "physics_step must be a number from"),
}


@pytest.fixture
def refused(as_from_a_shell, capfd, tmp_path):
    """Runs a command that must fail at once, and returns the one line that it says."""

    def run(path):
        assert main(["sim-collect", f"sim={path}", "rollouts=1", "steps=2", f"hydra.run.dir={tmp_path / 'out'}"]) == 1
        (line,) = capfd.readouterr().err.splitlines()
        assert line.startswith("twbal: error: ")
        assert len(line) < 1500
        assert str(path) in line
        assert not (tmp_path / "canary").exists()
        assert not (tmp_path / "out").exists()
        return line

    return run


@pytest.mark.parametrize("what", HOSTILE)
def test_a_hostile_simulation_is_refused_in_one_line_and_nothing_of_it_runs(what, refused, tmp_path):
    content, complaint = HOSTILE[what]
    path = tmp_path / "hostile.yaml"
    path.write_text(content.replace("{canary}", str(tmp_path / "canary")))
    assert complaint in refused(path)


class Trap:
    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return self.path.touch, ()


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (pickle.dumps(3), "is no text in UTF-8"),
        (bytes(range(256)) * 16, "is no"),
        (b"\0" * 4096, "is no yaml that can be read"),
        (GAIN.encode("utf-16"), "is no text in UTF-8"),
    ],
)
def test_what_is_no_text_is_refused(content, complaint, refused, tmp_path):
    (tmp_path / "odd.yaml").write_bytes(content)
    assert complaint in refused(tmp_path / "odd.yaml")


def test_a_pickle_is_refused_and_not_run_whatever_its_name(refused, tmp_path):
    (tmp_path / "odd.yaml").write_bytes(pickle.dumps(Trap(tmp_path / "canary")))
    assert "is no text in UTF-8" in refused(tmp_path / "odd.yaml")
    (tmp_path / "beside.yaml").write_text("effects: 3")
    (tmp_path / "beside.pkl").write_bytes(pickle.dumps(Trap(tmp_path / "canary")))
    assert "must be a mapping" in refused(tmp_path / "beside.yaml")


def test_what_is_no_file_is_refused_and_not_waited_for(refused, tmp_path):
    os.mkfifo(tmp_path / "pipe.yaml")
    (tmp_path / "folder.yaml").mkdir()
    (tmp_path / "endless.yaml").symlink_to("/dev/zero")
    (tmp_path / "circle.yaml").symlink_to("circle.yaml")
    (tmp_path / "nowhere.yaml").symlink_to("gone")
    assert "it is a pipe or a device" in refused(tmp_path / "pipe.yaml")
    assert "holds no simulation" in refused(tmp_path / "folder.yaml")
    assert "it is a pipe or a device" in refused(tmp_path / "endless.yaml")
    assert "symbolic links" in refused(tmp_path / "circle.yaml")
    assert "There is no simulation" in refused(tmp_path / "nowhere.yaml")


def test_the_run_folder_of_a_simulation_stands_for_it(gain, tmp_path):
    run = tmp_path / "run"
    run.mkdir()
    (run / "identified.yaml").write_text(gain.read_text())
    assert simulation(f"sim={run}") == JUST_GAIN


def test_a_run_folder_in_the_working_directory_is_found_by_its_plain_name(gain, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("run").mkdir()
    Path("run/augmented.yaml").write_text(gain.read_text())
    Path("nominal").mkdir()  # holds no simulation, so the choice of that name is meant
    assert simulation("sim=run") == JUST_GAIN
    assert simulation("sim=nominal")["effects"] == {}


def test_a_folder_that_is_not_there_is_said_to_be_none(capfd, as_from_a_shell):
    assert main(["sim-collect", "sim=outputs/typo"]) == 1
    assert "Nor is there a file or run folder outputs/typo." in capfd.readouterr().err


def test_a_folder_without_a_simulation_or_with_two_is_refused(gain, tmp_path, refused):
    assert "holds no simulation; expected is the run folder of `twbal diagnose`" in refused(tmp_path)
    for name in ("identified.yaml", "augmented.yaml"):
        (tmp_path / name).write_text(gain.read_text())
    assert "holds two simulations" in refused(tmp_path)


def test_a_link_to_a_simulation_is_followed(gain, tmp_path):
    (tmp_path / "link.yaml").symlink_to(gain)
    assert simulation(f"sim={tmp_path / 'link.yaml'}") == JUST_GAIN


def test_the_words_of_a_file_are_told_as_they_were_given(gain):
    given = f"sim={gain}"
    words = with_files(["seed=1", given, "updates=2"])
    assert len(words) > 3
    assert as_given(words) == [given, "seed=1", "updates=2"]
    assert as_given([*words, "more=1"]) == [given, "seed=1", "updates=2", "more=1"]
    assert as_given(["sim=nominal", "seed=1"]) == ["sim=nominal", "seed=1"]
