import shlex
import subprocess
from pathlib import Path

import numpy as np
import pytest
from hydra import compose
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.errors import HydraException
from omegaconf import OmegaConf

from twbal.cli import commands
from twbal.cli.commands import ROOT, command_line, compose_stage, stage_overrides, text, tree_of
from twbal.cli.composition import composing


@pytest.fixture(autouse=True)
def within_a_stage():
    with composing():
        yield


@pytest.mark.parametrize(
    "value",
    [
        *(None, True, False, 0, -3, 0.1, 1e-9, float("inf"), "plain", "a/b.pt", "null", "TRUE", "12", "1e3", "", " "),
        *(
            "two words",
            "two  words/and 3.pt",
            "a null",
            "a: b",
            " x",
            "x ",
            "it's",
            "a\\",
            "\\'",
            "a,b=c",
            "[x]",
            "{y}",
            "#",
            "ümlaut",
            "2026-11-20_10-00-00",
            "~a",
            "$b",
        ),
        *([], [1, "b c", [2.5]], {"a": 1, "b": {"c": "x y"}}),
    ],
)
def test_a_value_survives_the_way_through_an_override(value):
    parsed = OverridesParser.create().parse_override(f"key={text(value)}").value()
    assert OmegaConf.to_container(OmegaConf.create({"key": _plain(parsed)}))["key"] == value


@pytest.mark.parametrize(
    ("number", "written"),
    [(np.float64(11.5), "11.5"), (np.float32(0.5), "0.5"), (np.int64(3), "3"), (3, "3"), (3.0, "3.0")],
)
def test_a_number_of_numpy_is_written_as_one_of_python(number, written):
    assert text(number) == written


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["seed=4", "rollouts=7"],
        ["seed=1", "seed=2", "seed=1"],
        ["policy=saved", "policy.path='a b.pt'", "robot=regbot", "robot.body_mass=1.5"],
        ["policy=saved", "policy.path=a.pt", "policy={path:b.pt}"],
        ["robot.body_mass=1.5", "robot=regbot"],  # a choice comes first, wherever it stands
        ["robot.body_mass=1.5", "robot={body_mass:2.0}", "++robot.colour=blue", "++robot={colour:red}"],
        ["robot={body_mass:2.0}", "robot.body_mass=${robot.wheel_mass}"],
        ["start.tilt_sd=null", "policy.amplitude=[1,2]", "exploration=0.25"],
        ["sim=nominal", "++sim.effects.dead_zone={width:2.0}", "sim.physics_step=0.0005"],
        ["++sim.effects.dead_zone={width:2.0}", "sim.effects.dead_zone.width=3.0"],
        ["++robot.colour=red", "++robot.track=0.3", "robot.colour=blue"],
        ["sim.effects={}", "+effect@sim.effects.dead_zone=dead_zone"],
        ["+robot.colour=red", "robot.colour=blue", "~robot.track"],
        ["hydra.job.name=x", "seed=3"],
    ],
)
def test_a_stage_is_composed_as_hydra_composes_it(words):
    expected = compose("sim_collect", words)
    for _ in range(2):  # the second time from what is kept
        found = compose_stage("sim-collect", words)
        assert OmegaConf.to_container(found) == OmegaConf.to_container(expected)
        assert list(found) == list(expected)
        assert OmegaConf.is_struct(found)


@pytest.mark.parametrize(
    "word", ["sed=4", "robot.mass=1.0", "robot=nobody", "seed=1,2", "seed=[1", "hydra.jub=x", "start={tilt:0.1}"]
)
def test_what_hydra_refuses_is_refused_in_its_words(word):
    with pytest.raises(HydraException) as expected:
        compose("sim_collect", [word])
    with pytest.raises(HydraException) as found:
        compose_stage("sim-collect", [word])
    assert str(found.value) == str(expected.value)


def test_values_alone_let_hydra_compose_once(monkeypatch):
    composed = []

    def counted(*arguments, **named):
        composed.append(arguments)
        return compose(*arguments, **named)

    monkeypatch.setattr(commands, "compose", counted)
    commands._composed.cache_clear()
    words = ["policy=saved", "++sim.effects.dead_zone={width:2.0}"]
    paths = [compose_stage("sim-collect", [*words, f"policy.path={number}.pt"]).policy.path for number in range(3)]
    assert paths == ["0.pt", "1.pt", "2.pt"]
    assert len(composed) == 2  # the defaults, and the choice


def test_what_equals_the_defaults_needs_no_override():
    cfg = compose_stage("sim-collect", [])
    assert stage_overrides("sim-collect", tree_of(cfg), {"robot": "paper", "state": "default"}, []) == []


def test_choices_values_and_sections_are_handed_on():
    cfg = compose_stage(
        "sim-collect", ["robot=regbot", "state=paper", "robot.body_mass=1.5", "sim.physics_step=0.0005"]
    )
    OmegaConf.set_struct(cfg, False)
    del cfg["rollouts"]
    cfg.sim_collect = {"rollouts": 7}
    found = stage_overrides(
        "sim-collect", tree_of(cfg), {"robot": "regbot", "state": "paper", "model": "exact"}, ["seed=4"]
    )
    assert found[:2] in (["robot=regbot", "state=paper"], ["state=paper", "robot=regbot"])
    assert sorted(found[2:-1]) == ["robot.body_mass=1.5", "rollouts=7", "sim.physics_step=0.0005"]
    assert found[-1] == "seed=4"
    again = compose_stage("sim-collect", found)
    assert again.rollouts == 7
    assert again.seed == 4
    assert again.robot == cfg.robot
    assert again.state == cfg.state


def test_keys_may_come_and_go():
    cfg = compose_stage("sim-collect", ["+robot.colour=red", "~robot.track"])
    found = stage_overrides("sim-collect", tree_of(cfg), {"robot": "paper"}, [])
    assert found == ["++robot.colour=red", "~robot.track"]
    assert compose_stage("sim-collect", found) == cfg


def test_an_effect_may_be_added_to_a_simulation_that_has_none():
    cfg = compose_stage("sim-collect", ["+effect@sim.effects.dead_zone=dead_zone"])
    assert compose_stage("sim-collect", stage_overrides("sim-collect", tree_of(cfg), {}, [])) == cfg


def test_a_part_may_be_taken_out_as_a_whole():
    cfg = compose_stage("fit-diff-gp", ["model.smoothing=null"])
    found = stage_overrides("fit-diff-gp", tree_of(cfg), {}, ["dynamics=m", "episodes=e"])
    assert compose_stage("fit-diff-gp", found).model == cfg.model


def test_what_is_told_comes_before_the_choice_of_the_asking_stage():
    cfg = compose_stage("sim-collect", ["policy=random"])
    told = ["policy=saved", "policy.path=p.pt"]
    found = stage_overrides("real-rollout", tree_of(cfg), {"policy": "random", "robot": "paper"}, told)
    assert found[-2:] == told
    assert compose_stage("real-rollout", found).policy.path == "p.pt"


def test_what_an_experiment_came_to_is_handed_on_and_not_the_experiment():
    cfg = compose_stage("iterate", ["experiment=paper"])
    choices = {"experiment": "paper", "state": "paper", "link": "virtual"}
    found = stage_overrides("real-rollout", tree_of(cfg), choices, ["policy=saved", "policy.path=p.pt"])
    assert not [word for word in found if word.startswith("experiment")]
    assert compose_stage("real-rollout", found).state == cfg.state


def test_a_command_line_is_what_a_shell_hands_on():
    line = command_line("fit-sim-gp", ["episodes=[a b,c]"], Path("out puts/x"))
    assert shlex.split(line) == ["twbal", "fit-sim-gp", "episodes=[a b,c]", "hydra.run.dir=out puts/x"]


def test_the_run_folder_stays_a_variable_in_a_command_that_is_written_down(tmp_path):
    words = [f"episodes={text([str(ROOT / 'a b'), 'c'])}", "x='`$y'"]
    line = command_line("fit-sim-gp", words, ROOT / "out")
    said = subprocess.run(
        ["sh", "-c", f"twbal() {{ printf '%s\\n' \"$@\"; }}; OUT='it is, odd'; {line}"], capture_output=True, text=True
    ).stdout
    assert said.splitlines() == [
        "fit-sim-gp",
        "episodes=['it is, odd/a b',c]",
        "x='`$y'",
        "hydra.run.dir='it is, odd/out'",
    ]


def _plain(value):
    """Hydra's quoted strings as text."""
    if isinstance(value, list):
        return [_plain(inner) for inner in value]
    if isinstance(value, dict):
        return {str(key): _plain(inner) for key, inner in value.items()}
    return getattr(value, "text", value)
