"""The group `effect` of the configuration, which no file lists."""

import re

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
