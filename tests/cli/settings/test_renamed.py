"""Names of earlier versions are refused with the name that they have now."""

from pathlib import Path

import pytest

from twbal.cli.main import STAGES, main
from twbal.cli.settings import renamed
from twbal.cli.settings.lookup import GROUPS
from twbal.cli.settings.lookup import STAGES as OF_STAGES
from twbal.cli.settings.renamed import name_now

BEFORE = (Path(__file__).parent / "keys_before.txt").read_text().split()
KEYS = {row.key for rows in (*GROUPS.values(), *OF_STAGES.values()) for row in rows}

pytestmark = pytest.mark.usefixtures("as_from_a_shell")


def refusal(capsys, *words):
    assert main(list(words)) != 0
    (line,) = capsys.readouterr().err.splitlines()
    return line


@pytest.mark.parametrize("key", BEFORE)
def test_every_setting_of_the_version_before_is_there_or_named_anew(key):
    assert key in KEYS or name_now(key) in KEYS


def test_the_table_names_nothing_that_is_there():
    words = {"update", "tilt_limit"}  # of one stage still
    assert {old for old in renamed.SETTINGS if old in KEYS} == words
    assert not set(renamed.STAGES) & set(STAGES)
    assert set(renamed.STAGES.values()) <= set(STAGES)


@pytest.mark.parametrize(("old", "now"), renamed.STAGES.items())
def test_an_old_stage_is_one_error_that_says_the_new_one(old, now, capsys):
    assert refusal(capsys, old) == f"twbal: error: no stage {old!r} any more: it is called {now!r} now."


@pytest.mark.parametrize(
    ("words", "old", "now"),
    [
        (["iterate", "variants=none"], "variants", "ensemble"),
        (["iterate", "rehearsals=1"], "rehearsals", "search_retries"),
        (["iterate", "rule.limit=0.4"], "rule.limit", "success.tilt_limit"),
        (["iterate", "linear_policy.command_width=2"], "linear_policy.command_width", "lqr.command_width"),
        (["iterate", "optimise_policy.searches=false"], "optimise_policy.searches", "optimise_policy.optimise"),
        (["iterate", "real_rollout.tilt_limit=0.4"], "real_rollout.tilt_limit", "tilt_limit"),
        (["iterate", "shape=paper"], "shape", "parametrisation"),
        (["iterate", "+effect@variants.heavy.body_mass=body_mass"], "variants.heavy.body_mass.factor", None),
        (["optimise-policy", "dynamics=m.pt", "search.content=0.5"], "search.content", "search.min_success_rate"),
        (["regress", "recordings.shortest=9"], "recordings.shortest", "recordings.min_length"),
        (["virtual-robot", "hidden=none"], "hidden", "faults"),
        (["virtual-robot", "tilt_limit=1"], "tilt_limit", "self_stop_tilt"),
    ],
)
def test_an_old_setting_is_one_error_that_says_the_new_one(words, old, now, capsys):
    now = now or old.replace("variants", "ensemble")
    assert (
        refusal(capsys, *words)
        == f"twbal: error: {words[0]} has no setting {old!r} any more: it is called {now!r} now."
    )


@pytest.mark.parametrize(
    ("old", "now"),
    [
        ("share", "min_gain_share"),
        ("least", "min_effect_size"),
        ("whiteness", "max_autocorrelation"),
        ("discrepancy", "max_discrepancy"),
        ("strain", "max_tolerance_statistic"),
        ("shift", "min_reported_shift"),
        ("beyond", "max_shift"),
        ("steady", "max_size_difference"),
        ("form", "form_error"),
        ("margin", "equivalence_margin"),
    ],
)
@pytest.mark.parametrize("plus", ["", "+", "++"])
def test_each_old_threshold_of_a_diagnosis_is_one_error_that_says_the_new_one(plus, old, now, capsys):
    said = refusal(capsys, "diagnose", "episodes=e", f"{plus}diagnosis.lines.{old}=1")
    now = f"diagnosis.thresholds.{now}"
    assert said == f"twbal: error: diagnose has no setting 'diagnosis.lines.{old}' any more: it is called {now!r} now."


@pytest.mark.parametrize(
    "old", ["lines.score", "lines.sheet", "thresholds.min_score", "thresholds.min_data_sheet_score"]
)
def test_an_old_least_score_is_one_error_that_says_what_it_follows_from_now(old, capsys):
    said = refusal(capsys, "diagnose", "episodes=e", f"diagnosis.{old}=30")
    assert said.endswith("(diagnosis.thresholds.false_alarm_probability).") and "least scores are simulated" in said


def test_the_thresholds_by_their_old_group_are_one_error_that_says_the_new_one(capsys):
    said = refusal(capsys, "diagnose", "episodes=e", "diagnosis.lines={}")
    assert said.endswith("no setting 'diagnosis.lines' any more: it is called 'diagnosis.thresholds' now.")


@pytest.mark.parametrize("old", ["diagnosis.usual", "diagnosis.common_effects"])
def test_effects_to_begin_with_are_one_error_that_says_what_a_search_does_now(old, capsys):
    said = refusal(capsys, "diagnose", "episodes=e", f"{old}=[dead_zone]")
    assert f"has no setting {old!r} any more: a search begins with what hardly a robot is without" in said


def test_an_old_setting_that_may_be_a_slip_for_another_one_names_both(capsys):
    said = refusal(capsys, "iterate", "update=2")
    assert said.endswith("it is called 'model_update' now. Or did you mean 'updates'?")


@pytest.mark.parametrize(("old", "now"), renamed.CHOICES["diagnosis"].items())
def test_an_old_choice_is_one_error_that_says_the_new_one(old, now, capsys):
    said = refusal(capsys, "diagnose", "episodes=e", f"diagnosis={old}")
    assert said == f"twbal: error: diagnosis has no choice {old!r} any more: it is called {now!r} now."


@pytest.mark.parametrize(
    ("old", "instead"),
    [
        ("rough", "give the tolerance itself, diagnosis.tolerances.data_sheet=0.15."),
        ("loose_tolerance", "give the tolerance itself, diagnosis.tolerances.data_sheet=0.15."),
        ("several", "the default finds several effects, too; leave it out."),
        ("multi_effect", "the default finds several effects, too; leave it out."),
    ],
)
def test_a_choice_that_has_gone_is_one_error_that_says_what_to_do(old, instead, capsys):
    said = refusal(capsys, "diagnose", "episodes=e", f"diagnosis={old}")
    assert said == f"twbal: error: diagnosis has no choice {old!r} any more: {instead}"


def test_an_old_setting_in_a_yaml_of_ones_own_is_refused(tmp_path, capsys):
    (tmp_path / "mine" / "experiment").mkdir(parents=True)
    (tmp_path / "mine" / "experiment" / "mine.yaml").write_text("# @package _global_\nrule:\n  steps: 30\n")
    words = ["real-rollout", "policy.path=p.pt", f"--config-dir={tmp_path / 'mine'}", "experiment=mine"]
    assert (
        "has no setting 'rule.steps' any more: it is called 'success.duration' now, in seconds instead of"
        in refusal(capsys, "iterate", *words[2:])
    )


@pytest.mark.parametrize(
    ("old", "now"),
    [
        ("success.steps=500", "success.duration"),
        ("success.settle_step=100", "success.settle_time"),
        ("rule.steps=500", "success.duration"),
    ],
)
@pytest.mark.parametrize(
    "stage", [["iterate"], ["optimise-policy", "dynamics=m.pt"], ["train-agent"]], ids=lambda s: s[0]
)
def test_times_of_the_rule_that_were_control_periods_say_that_they_are_seconds(stage, old, now, capsys):
    said = refusal(capsys, *stage, old)
    assert said.endswith(f"any more: it is called {now!r} now, in seconds instead of control periods.")
