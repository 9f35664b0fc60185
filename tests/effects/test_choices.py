"""The group `effect` of the configuration, which no file lists."""

import re

import pytest

from twbal.cli.main import main


def test_a_yaml_of_ones_own_is_a_choice_beside_those_of_the_library(as_from_a_shell, tmp_path, capsys):
    (tmp_path / "mine" / "effect").mkdir(parents=True)
    text = "_target_: twbal.effects.dead_zone.DeadZone\nwidth: 0.7\n"
    (tmp_path / "mine" / "effect" / "small_zone.yaml").write_text(text)
    words = [f"+effect@sim.effects.{name}={name}" for name in ("small_zone", "backlash")]
    assert main(["sim-collect", f"--config-dir={tmp_path / 'mine'}", *words, "--cfg", "job"]) == 0
    said = capsys.readouterr().out
    assert re.search(r"small_zone:\n +_target_: twbal\.effects\.dead_zone\.DeadZone\n +width: 0\.7", said)
    assert re.search(r"backlash:\n +_target_: twbal\.effects\.backlash\.Backlash\n +gap: 0\.05", said)


def test_an_unknown_effect_is_told_those_that_there_are(as_from_a_shell, capsys):
    assert main(["sim-collect", "+effect@sim.effects.zone=dead_zon", "--cfg", "job"]) == 1
    said = capsys.readouterr().err
    assert "effect has no choice 'dead_zon' (did you mean 'dead_zone'?)" in said
    assert "actuation_delay, backlash, backlash_behind_encoder, battery_sag" in said


def test_the_shell_completes_the_names_of_effects(as_from_a_shell, monkeypatch, capsys):
    monkeypatch.setenv("COMP_LINE", "twbal sim-collect +effect=ba")
    assert main(["-sc", "query=bash"]) == 0
    assert capsys.readouterr().out.split() == [
        "+effect=backlash",
        "+effect=backlash_behind_encoder",
        "+effect=battery_sag",
    ]


def test_a_sweep_goes_through_effects(as_from_a_shell, tmp_path, capsys):
    words = ["+effect@sim.effects.backlash=backlash", "sim.effects.backlash.gap=0.01,0.02", "rollouts=1", "steps=2"]
    assert main(["sim-collect", "-m", *words]) == 0
    assert len(list(tmp_path.rglob("*.mcap"))) == 2


@pytest.fixture
def said(as_from_a_shell, tmp_path, capfd):
    """What a command says that must fail before it makes anything."""

    def run(*words):
        assert main(["sim-collect", *words]) == 1
        assert not list(tmp_path.iterdir())
        return [line for line in capfd.readouterr().err.splitlines() if "pybullet build time" not in line][-1]

    return run


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (
            "+effect@sim.effects.a=dead_zone +effect@sim.effects.b=dead_zone",
            "sim.effects.a and sim.effects.b are the effect dead_zone twice; give one with what both do together.",
        ),
        (
            "robot=regbot +effect@sim.effects.dead_zone=dead_zone",
            "With sim.effects.dead_zone, no command up to the torque limit of 0.49 N·m turns the wheels of regbot; try "
            "sim.effects.dead_zone.width=0.0245 (",
        ),
        (
            "robot=regbot +effect@sim.effects.f=coulomb_friction +effect@sim.effects.v=viscous_friction "
            "sim.effects.v.coefficient=0.001",
            "With sim.effects.f, no command up to the torque limit of 0.49 N·m turns the wheels of regbot; try "
            "sim.effects.f.torque=0.00735 (",
        ),
        (
            "+effect@sim.effects.gain=torque_gain sim.effects.gain.gain=0.03 +effect@sim.effects.zone=coulomb_friction",
            "With sim.effects.gain and sim.effects.zone, no command up to the torque limit of 20 N·m turns",
        ),
    ],
)
def test_effects_that_cannot_be_meant_are_refused_before_anything_runs(words, expected, said):
    assert expected in said(*words.split())


@pytest.mark.parametrize("word", ["width=0.0245", "width=0.4"])
def test_an_effect_of_the_robots_size_is_taken(word, as_from_a_shell, tmp_path):
    words = ["robot=regbot", "+effect@sim.effects.dead_zone=dead_zone", f"sim.effects.dead_zone.{word}"]
    assert main(["sim-collect", *words, "rollouts=1", "steps=2"]) == 0
