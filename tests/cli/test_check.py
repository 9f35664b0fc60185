"""`twbal regress` on the logged data of the repository: quiet on clean code, loud on every planted fault."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from twbal.cli.main import main
from twbal.cli.stages.regress import Baseline, _read, _tolerances
from twbal.core.errors import TwbalError
from twbal.core.json_records import write_record

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "data" / "regression"
FAULTS = {
    "kernel": ("models/gp.py", "-= 0.5 * np.sum(a * a", "-= 0.49 * np.sum(a * a"),
    "moment matching": (
        "models/moments/taylor.py",
        "weights[i] * scale * np.exp(-0.5",
        "weights[i] * scale * np.exp(-0.501",
    ),
    "squash": ("policies/squash.py", "9.0 * np.sin(activation)", "9.01 * np.sin(activation)"),
    "squash's moments": ("policies/squash.py", "variance += 0.5 * p * q", "variance += 0.501 * p * q"),
    "cost": ("core/cost.py", "reward = np.exp(-0.5 * (gap", "reward = np.exp(-0.51 * (gap"),
    "log reader": ("io/logs/rows.py", '"wheel_angle", "wheel_rate")', '"wheel_rate", "wheel_angle")'),
    "effect": ("effects/dead_zone.py", "return torque - forward", "return torque - 0.99 * forward"),
    "effect with a memory": ("effects/motor_lag.py", "torque += share", "torque += 0.99 * share"),
    "policy file": ("policies/policy.py", 'payload.number("max_command"', '0.999 * payload.number("max_command"'),
    "transitions": ("core/channels.py", "matrix[i, i] = 1.0", "matrix[i, i] = 1.001"),
    "gradient": ("search/long_term_cost.py", "by_mean + costs[t].by_mean", "by_mean + 1.001 * costs[t].by_mean"),
    "planar model": (
        "planar/dry_friction.py",
        "return wheel_bound(k, relative - apart) + wheel_bound(k, relative + apart)",
        "return 0.75 * (wheel_bound(k, relative - apart) + wheel_bound(k, relative + apart))",
    ),
    "predictor": (
        "sysid/kalman_predictor.py",
        "tilt_rate, speed = _gained(gains[instant, 2], error)",
        "tilt_rate, speed = 0.5 * _gained(gains[instant, 2], error)",
    ),
    "smoothing": ("models/recipe.py", "if self.smoothing is None:", "if True:"),
}
"""File of the package, a line of it, and that line with a fault."""


def check(*words, package=ROOT, cache=None):
    """Run the command on a copy of the package."""
    env = {**os.environ, "PYTHONPATH": str(package), "OMP_NUM_THREADS": "1"}
    if cache is not None:
        env["XDG_CACHE_HOME"] = str(cache)
    command = [sys.executable, "-P", "-m", "twbal", "regress", f"data={DATA}", *words]
    return subprocess.run(command, env=env, capture_output=True, text=True)


def test_clean_code_makes_of_the_logs_what_it_made_before_but_for_fit_and_diagnosis(tmp_path, monkeypatch, capsys):
    known = json.loads((DATA / "baseline.json").read_text())["measures"]
    for part in ("fit", "diagnosis"):  # which take most of the time, and are as they were
        same = {name: value for name, value in known.items() if name.startswith(f"{part}/")}
        monkeypatch.setattr(f"twbal.cli.stages.regress.{part}_measures", lambda *_, same=same: same)
    assert main(["regress", f"data={DATA}", f"hydra.run.dir={tmp_path}"]) == 0
    assert "measures are as in the baseline" in capsys.readouterr().out
    assert (tmp_path / "junit.xml").exists()


@pytest.mark.slow
def test_clean_code_makes_of_the_logs_what_it_made_before(tmp_path):
    done = check(f"hydra.run.dir={tmp_path}")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "measures are as in the baseline" in done.stdout
    assert (tmp_path / "junit.xml").exists()


def spoiled(tmp_path, change):
    """A copy of the data's baseline, changed."""
    known = json.loads((DATA / "baseline.json").read_text())
    change(known)
    path = tmp_path / "baseline.json"
    path.write_text(json.dumps(known))
    return path


@pytest.mark.slow
def test_a_measure_that_moved_fails_and_is_named(tmp_path, capsys):
    name = "policy/commands/rms"
    path = spoiled(tmp_path, lambda known: known["measures"].update({name: 1.001 * known["measures"][name]}))
    assert main(["regress", f"data={DATA}", f"baseline={path}", f"hydra.run.dir={tmp_path / 'out'}"]) == 1
    said = capsys.readouterr()
    assert name in said.out
    assert "1 of " in said.err
    assert '<failure message="' in (tmp_path / "out" / "junit.xml").read_text()


def test_an_update_rewrites_what_moved_alone(tmp_path, monkeypatch, capsys):
    names = {part: f"{part}/number" for part in ("fit", "search")}  # with a tolerance of 10 %, and of 1e-5
    found = Baseline({"policy.pt": "1"}, "2", {names["fit"]: 1.01, names["search"]: 1.01})
    monkeypatch.setattr("twbal.cli.stages.regress.measure", lambda cfg, folder: found.measures)
    monkeypatch.setattr("twbal.cli.stages.regress._hashes", lambda folder: found.data)
    path, words = tmp_path / "baseline.json", ["regress", f"data={DATA}", "update=true", f"hydra.run.dir={tmp_path}"]
    for before, kept in (
        (None, 1.01),
        ("no baseline", 1.01),
        (Baseline({"policy.pt": "1"}, "1", {names["fit"]: 1.0, names["search"]: 1.0, "search/gone": 1.0}), 1.0),
        (Baseline({"policy.pt": "0"}, "1", {names["fit"]: 1.0, names["search"]: 1.0}), 1.01),  # of other data
    ):
        if isinstance(before, Baseline):
            write_record(path, before)
        elif before is not None:
            path.write_text(before)
        assert main([*words, f"baseline={path}"]) == 0
        assert _read(path).measures == {names["fit"]: kept, names["search"]: 1.01}
    assert "2 measures; 2 are new, gone or moved" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["data=nowhere"], "nowhere"),
        ([f"data={DATA}", "baseline=no.json", "tolerances=no.yaml"], "no tolerances no.yaml"),
    ],
)
def test_what_is_not_there_is_one_clear_line(words, complaint, tmp_path, capsys):
    assert main(["regress", *words, f"hydra.run.dir={tmp_path}"]) == 1
    said = capsys.readouterr().err
    assert complaint in said
    assert len(said.splitlines()) == 1


@pytest.mark.parametrize(
    ("change", "tolerances", "complaint"),
    [
        (lambda known: known["data"].update({"policy.pt": "0" * 64}), None, "another data set: policy.pt differ"),
        (lambda known: known.update(extra=1), None, "is no baseline of `twbal regress`"),
        (lambda known: None, "'cost/*': {relative: 0, absolute: 0}", "No tolerance fits the measure"),
    ],
)
def test_a_baseline_that_cannot_be_compared_with_is_refused_before_anything_is_measured(
    change, tolerances, complaint, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr("twbal.cli.stages.regress.measure", lambda cfg, folder: pytest.fail("it measures"))
    words = [f"baseline={spoiled(tmp_path, change)}"]
    if tolerances is not None:
        (tmp_path / "tolerances.yaml").write_text(tolerances)
        words.append(f"tolerances={tmp_path / 'tolerances.yaml'}")
    assert main(["regress", f"data={DATA}", *words, f"hydra.run.dir={tmp_path / 'out'}"]) == 1
    assert complaint in capsys.readouterr().err


def test_every_fault_has_its_place():
    assert not [name for name, (file, line, _) in FAULTS.items() if line not in (ROOT / "twbal" / file).read_text()]


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_a_planted_fault_is_caught(fault, tmp_path):
    file, line, wrong = FAULTS[fault]
    package = tmp_path / "package"
    shutil.copytree(ROOT / "twbal", package / "twbal", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(ROOT / "conf", package / "conf")
    source = package / "twbal" / file
    text = source.read_text()
    assert text.count(line) >= 1
    source.write_text(text.replace(line, wrong))
    done = check(f"hydra.run.dir={tmp_path / 'out'}", package=package, cache=tmp_path / "cache")
    assert done.returncode == 1, done.stdout + done.stderr
    assert "twbal: error:" in done.stderr


@pytest.mark.parametrize(
    ("name", "content", "complaint"),
    [
        ("tolerances", '"*": {relative: nan, absolute: 0}', "must be finite and not negative"),
        ("tolerances", '"*": {relative: 0}', "does not say tolerances"),
        ("tolerances", "a: [", "is no yaml that can be read"),
        ("tolerances", '"*": &a {relative: 0, absolute: 0}', "has an anchor or an alias"),
        ("tolerances", "[" * 10**4, "holds too much"),
        ("baseline", "[" * 10**5, "is no baseline of `twbal regress`"),
        ("baseline", '{"data": 3, "version": "", "measures": {}}', "is no baseline of `twbal regress`"),
        ("baseline", '{"data": {}, "version": "", "measures": {"a": []}}', "is no baseline of `twbal regress`"),
    ],
)
def test_files_that_cannot_be_used_are_refused(name, content, complaint, tmp_path):
    (tmp_path / "file").write_text(content)
    with pytest.raises(TwbalError, match=complaint):
        (_tolerances if name == "tolerances" else _read)(tmp_path / "file")
