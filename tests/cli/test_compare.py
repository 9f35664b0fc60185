"""`twbal compare` over run folders."""

import csv
import json

import pytest

from twbal.cli.main import main
from twbal.cli.manifest import Manifest
from twbal.core.json_records import write_record


def summary(successes, seconds, seed):
    iterations = [
        {
            "index": k,
            "real_episodes": k,
            "real_samples": 100 * k,
            "real_seconds": seconds * k,
            "predicted_cost": 5.0,
            "real_cost": 6.0 - k,
            "successes": count,
            "trials": 10,
            "coverage95": 0.9,
            "fit_s": 1.0,
            "search_s": 2.0,
            "drift_m": 1.0,
            "judged_success": 1.0,
            "policy": {"path": "p.pt", "sha256": "0" * 64},
            "note": "",
        }
        for k, count in enumerate(successes)
    ]
    return {
        "robot": "paper",
        "seed": seed,
        "wall_s": 10.0,
        "sim": {"episodes": 20, "samples": 300},
        "iterations": iterations,
        "best_iteration": max(range(len(successes)), key=lambda k: successes[k]),
    }


@pytest.fixture
def sweeps(tmp_path):
    for name, successes, seconds in (("old", [0, 4, 10], 3.0), ("new", [0, 10], 2.0)):
        for seed in range(6):
            folder = tmp_path / name / str(seed)
            folder.mkdir(parents=True)
            (folder / "summary.json").write_text(json.dumps(summary(successes, seconds, seed)))
    return tmp_path


def test_two_sweeps_make_one_table_and_one_page(sweeps, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["compare", f"runs={{old:{sweeps / 'old'},new:{sweeps / 'new'}}}", f"hydra.run.dir={out}"]) == 0
    with (out / "table.csv").open() as file:
        old, new = csv.DictReader(file)
    assert old["driven to learn until all trials succeed [s]"].startswith("6 ")
    assert new["driven to learn until all trials succeed [s]"].startswith("2 ")
    assert new["driven to learn until all trials succeed: better, worse, pairs, p"] == "6, 0, 6, 0.031"
    assert len((out / "runs.csv").read_text().splitlines()) == 13
    assert "<svg" in (out / "comparison.html").read_text()
    assert (out / "table.tex").read_text().startswith(r"\begin{tabular}")
    *table, last = capsys.readouterr().out.splitlines()
    assert any(line.startswith("driven to learn until all trials succeed") for line in table)
    rows = [line for line in table if not line.startswith("made ")]
    assert len({len(line) for line in rows}) == 1  # the columns stand under each other
    assert last == f"next  look at {out / 'comparison.html'}"


@pytest.mark.parametrize(
    ("runs", "complaint"),
    [
        ("[nowhere]", "nowhere is not there"),
        (f"['{__file__}']", "is no folder. Give a run folder"),
        ("[]", "compare cannot have runs=[]"),
        ("[a/x,b/x]", "same name"),
    ],
)
def test_bad_input_is_one_clear_line(runs, complaint, tmp_path, capsys):
    assert main(["compare", f"runs={runs}", f"hydra.run.dir={tmp_path}"]) == 1
    said = capsys.readouterr().err
    assert complaint in said
    assert len(said.splitlines()) == 1


def test_an_empty_folder_and_a_summary_of_another_version_are_refused(sweeps, tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    assert main(["compare", f"runs=[{tmp_path / 'empty'}]", f"hydra.run.dir={tmp_path / 'out'}"]) == 1
    assert "no summary.json" in capsys.readouterr().err
    file = sweeps / "old" / "0" / "summary.json"
    told = json.loads(file.read_text())
    del told["iterations"][0]["coverage95"]
    file.write_text(json.dumps(told))
    assert main(["compare", f"runs=[{sweeps / 'old'}]", f"hydra.run.dir={tmp_path / 'out'}"]) == 1
    assert "coverage95" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        ("a: [", "is no yaml that can be read"),
        ("a: &a [1]\nb: [*a, *a]", "has an anchor or an alias"),
        ("[" * 99, "holds"),
    ],
)
def test_a_damaged_configuration_of_a_run_is_one_clear_line(settings, complaint, sweeps, tmp_path, capsys):
    (sweeps / "old" / "0" / ".hydra").mkdir()
    (sweeps / "old" / "0" / ".hydra" / "config.yaml").write_text(settings)
    assert main(["compare", f"runs=[{sweeps / 'old'}]", f"hydra.run.dir={tmp_path / 'out'}"]) == 1
    (said,) = capsys.readouterr().err.splitlines()
    assert complaint in said
    assert "config.yaml" in said


def test_runs_on_robots_of_other_seeds_are_not_paired(sweeps, tmp_path, capsys):
    for name, link in (("old", 1), ("new", 2)):
        for seed in range(6):
            (sweeps / name / str(seed) / ".hydra").mkdir()
            (sweeps / name / str(seed) / ".hydra" / "config.yaml").write_text(f"link: {{seed: {link}}}\nrun: ${{x}}\n")
    out = tmp_path / "out"
    main(["compare", f"runs={{old:{sweeps / 'old'},new:{sweeps / 'new'}}}", f"hydra.run.dir={out}"])
    with (out / "table.csv").open() as file:
        new = list(csv.DictReader(file))[1]
    assert {value for key, value in new.items() if key.endswith("better, worse, pairs, p")} == {"-"}
    assert "no run of new has robot and seeds of one of old" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ("success: {duration: 10.0}\ncost: {a: 1}\n", []),
        ("success: {duration: 5.0}\ncost: {a: 1}\n", ["rule of success"]),
        ("success: {duration: 5.0}\ncost: {a: 2}\n", ["rule of success", "cost function"]),
        ("{}\n", []),
    ],
    ids=["alike", "another rule", "another rule and cost", "not told"],
)
def test_runs_that_were_judged_otherwise_are_warned_of(settings, said, sweeps, tmp_path, capsys):
    for name, written in (("old", "success: {duration: 10.0}\ncost: {a: 1}\n"), ("new", settings)):
        for run in (sweeps / name).iterdir():
            (run / ".hydra").mkdir()
            (run / ".hydra" / "config.yaml").write_text(written)
    assert (
        main(["compare", f"runs={{old:{sweeps / 'old'},new:{sweeps / 'new'}}}", f"hydra.run.dir={tmp_path / 'out'}"])
        == 0
    )
    warned = [line for line in capsys.readouterr().out.splitlines() if line.startswith("WARNING: ")]
    assert [what for what in ("rule of success", "cost function") if any(what in line for line in warned)] == said
    assert len(warned) == len(said)


def configured(folder, **settings):
    """A run's configuration and the words of its command."""
    (folder / ".hydra").mkdir(exist_ok=True)
    (folder / ".hydra" / "config.yaml").write_text(json.dumps(settings))


def told(folder, *words):
    (folder / ".hydra" / "overrides.yaml").write_text(json.dumps(words))


def table_of(out):
    with (out / "table.csv").open() as file:
        return list(csv.DictReader(file))


COST = "real long-term cost, best policy"


def test_costs_over_unlike_horizons_are_not_pooled_and_the_setting_is_named(sweeps, tmp_path, capsys):
    out = tmp_path / "out"
    for name in ("old", "new"):
        for seed in range(6):
            configured(sweeps / name / str(seed), search={"horizon": 100 if seed else 40}, cost={"a": 1})
    assert main(["compare", f"runs=[{sweeps / 'old'}]", f"hydra.run.dir={out}"]) == 0  # within a group
    assert "WARNING: the runs do not have the same horizon (search.horizon=40 or 100)" in capsys.readouterr().out
    (row,) = table_of(out)
    assert row[COST] == row["widest 95 % band of the tilt, best policy [rad]"] == "-"
    assert row["share of trials that succeed, best policy"] != "-"
    page = (out / "comparison.html").read_text()
    assert "The runs do not have the same horizon (search.horizon=40 or 100)" in page
    with (out / "runs.csv").open() as file:
        assert {each["cost"] for each in csv.DictReader(file)} == {"4.0"}  # each run's own stays


def test_between_groups_what_was_judged_by_unlike_rules_is_a_dash(sweeps, tmp_path):
    for name, duration in (("old", 10.0), ("new", 5.0)):
        for seed in range(6):
            configured(sweeps / name / str(seed), success={"duration": duration, "place_radii": 1.0})
    out = tmp_path / "out"
    assert main(["compare", f"runs={{old:{sweeps / 'old'},new:{sweeps / 'new'}}}", f"hydra.run.dir={out}"]) == 0
    for row in table_of(out):
        for what in ("share of trials that succeed, best policy", "drift in a trial, best policy [m]"):
            assert row[what] == "-"
        assert row[COST] != "-"


def test_a_sweep_of_further_settings_is_a_group_for_each_of_their_combinations(sweeps, tmp_path, capsys):
    for seed in range(6):
        folder = sweeps / "old" / str(seed)
        words = [f"seed={seed % 3}", "link.seed=1", "updates=2", f"search.iterations={30 if seed < 3 else 60}"]
        (folder / "summary.json").write_text(json.dumps(summary([0, 10], 2.0, seed % 3)))
        configured(folder, link={"seed": 1})
        told(folder, *words)
    out = tmp_path / "out"
    assert main(["compare", f"runs=[{sweeps / 'old'}]", f"hydra.run.dir={out}"]) == 0
    first, second = table_of(out)
    assert (first["group"], first["runs"]) == ("old: search.iterations=30", "3")
    assert (second["group"], second["runs"]) == ("old: search.iterations=60", "3")
    assert second["driven in trials until then: better, worse, pairs, p"] == "-"  # not noted in these summaries
    assert second["driven to learn until all trials succeed: better, worse, pairs, p"] == "0, 0, 3, 1"
    assert "WARNING" not in capsys.readouterr().out


def test_runs_that_share_robot_and_seeds_for_no_known_reason_are_warned_of(sweeps, tmp_path, capsys):
    for seed in range(6):
        (sweeps / "old" / str(seed) / "summary.json").write_text(json.dumps(summary([0, 10], 2.0, seed % 2)))
    assert main(["compare", f"runs=[{sweeps / 'old'}]", f"hydra.run.dir={tmp_path / 'out'}"]) == 0
    said = capsys.readouterr().out
    assert "WARNING: 6 runs of old have 2 different robots and seeds between them: those that share them cannot" in said


def test_jobs_without_a_summary_are_told(sweeps, tmp_path, capsys):
    failed, other = sweeps / "old" / "failed", sweeps / "old" / "other"
    failed.mkdir()
    (failed / "failure.log").write_text("cost.widths.tilt=-1\niterate cannot have it\nsweep 1\n")
    write_record(
        _made(other) / "manifest.json",
        Manifest("sim-collect", True, "", 0, "{}", {}, (), {}, "2026-01-01T00:00:00Z", 1.0),
    )
    for seed in range(6):
        (sweeps / "old" / str(seed) / ".hydra").mkdir()
    out = tmp_path / "out"
    assert main(["compare", f"runs=[{sweeps / 'old'}]", f"hydra.run.dir={out}"]) == 0
    said = "1 of 7 jobs of old has no summary.json (failed: failed: iterate cannot have it) and is left out"
    assert f"WARNING: {said}" in capsys.readouterr().out
    assert said in (out / "comparison.html").read_text()


def _made(folder):
    folder.mkdir(parents=True)
    return folder


def test_runs_without_their_hidden_files_are_told_apart_by_their_manifests(sweeps, tmp_path):
    for name, link in (("old", 1), ("new", 2)):
        for seed in range(6):
            settings = f"link:\n  seed: {link}\nseed: {seed}\n"
            write_record(
                sweeps / name / str(seed) / "manifest.json",
                Manifest("iterate", True, "", seed, settings, {}, (), {}, "2026-01-01T00:00:00Z", 1.0),
            )
    out = tmp_path / "out"
    assert main(["compare", f"runs={{old:{sweeps / 'old'},new:{sweeps / 'new'}}}", f"hydra.run.dir={out}"]) == 0
    with (out / "runs.csv").open() as file:
        keys = {row["key"] for row in csv.DictReader(file)}
    assert keys == {f"paper {seed} {link}" for seed in range(6) for link in (1, 2)}
