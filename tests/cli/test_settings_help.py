"""`twbal <stage> --help` shows every setting in one line with default, range, unit and meaning."""

import re

import pytest
from hydra import compose
from omegaconf import OmegaConf

from twbal.cli.composition import composing
from twbal.cli.config_check import check_configuration
from twbal.cli.main import STAGES, main
from twbal.cli.settings.help_text import WIDTH
from twbal.cli.settings.lookup import Table, leaves

pytestmark = pytest.mark.usefixtures("as_from_a_shell")


@pytest.fixture
def helped(capsys):
    """The lines of a stage's help."""

    def run(*words):
        assert main([*words, "--help"]) == 0
        return capsys.readouterr().out.splitlines()

    return run


@pytest.mark.parametrize("stage", STAGES)
def test_each_setting_has_one_line_with_its_range_unit_and_meaning(stage, helped):
    lines = helped(stage)
    assert max(map(len, lines)) <= WIDTH
    with composing():
        tree = OmegaConf.to_container(compose(stage.replace("-", "_")))
    table = Table(stage, tree)
    for leaf in leaves(tree):
        (line,) = [line for line in lines if line.startswith(f"  {leaf.key}=")]
        row = table.row(leaf.key)
        assert f"{row.kind.range} {row.kind.unit}".strip() in line
        assert line.endswith(("...", row.meaning))


def test_what_is_changed_most_comes_first(helped):
    lines = helped("iterate")
    most, others = (lines.index(next(line for line in lines if line.startswith(head))) for head in ("Settings", "All"))
    assert all(most < lines.index(line) < others for line in lines if re.match(r"  (seed|updates|link\.seed)=", line))
    assert all(lines.index(line) > others for line in lines if re.match(r"  (robot|model|diagnosis\.lines)\.", line))


def test_choices_are_those_of_the_stage_with_the_chosen_one_marked(helped):
    lines = helped("sim-collect", "robot=regbot")
    assert any(re.match(r"  robot +balboa .* paper \[regbot\] ", line) for line in lines)
    assert not any(re.match(r"  (link|effect|stage|search)\b", line) for line in lines)


def test_help_shows_the_settings_of_what_is_chosen(helped):
    lines = helped("sim-collect", "+effect@sim.effects.dead_zone=dead_zone", "policy=saved", "seed=3")
    assert any(re.match(r"  sim\.effects\.dead_zone\.width=1\.0 +0 to 50 N·m +half width", line) for line in lines)
    assert any(re.match(r"  policy\.path=\?\?\? +path", line) for line in lines)
    assert any(line.startswith("  seed=3 ") for line in lines)


def test_help_shows_choices_and_settings_of_ones_own(helped, tmp_path):
    (tmp_path / "mine" / "policy").mkdir(parents=True)
    (tmp_path / "mine" / "policy" / "mine.yaml").write_text("_target_: mine.Policy\nsize: 3\n")
    lines = helped("sim-collect", f"--config-dir={tmp_path / 'mine'}", "policy=mine")
    assert any(re.match(r"  policy +excite \[mine\] random saved", line) for line in lines)
    assert "  policy.size=3" in lines


def test_only_a_stage_with_a_simulation_tells_how_an_effect_is_added(helped):
    told = "+effect@sim.effects.<name>=<name> adds an effect to the simulation (docs/effects.md)."
    assert told in helped("sim-collect") and told not in helped("lqr")


def test_a_list_is_shown_as_it_can_be_given_back(helped):
    (line,) = [line for line in helped("real-rollout") if line.startswith("  link.overrides=")]
    shown = line.split()[0]
    assert shown == 'link.overrides=["idle_timeout=300"]'
    assert any(line.startswith(f"  {shown} ") for line in helped("real-rollout", shown))


@pytest.mark.parametrize("stage", STAGES)
def test_several_paths_are_shown_as_a_list(stage, helped):
    assert not [line for line in helped(stage) if re.search(r"=<[^>]*>[.\w]*,\.\.\.", line)]


@pytest.mark.parametrize("word", ["robot.wheel_inertia=1e-9", "start.tilt_mean=1.5", "start.tilt_mean=-1.5"])
def test_both_ends_of_a_range_may_be_taken(word):
    with composing():
        check_configuration(compose("iterate", [word]), "iterate")


def test_the_least_inertia_of_a_wheel_is_the_robots_own(helped):
    (line,) = [line for line in helped("lqr") if line.startswith("  robot.wheel_inertia=")]
    assert "1e-9 to" in line
