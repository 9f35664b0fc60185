"""Whatever lies in the yaml and JSON files that people hand to each other: it is data, or one of twbal's errors."""

import json
from pathlib import Path

import yaml
from fuzzing import changed, fuzzed, mutated, ours_only, plain
from hypothesis import strategies as st

from twbal.algorithm.summary import read_summary
from twbal.cli.manifest import read_manifest
from twbal.cli.sim_files import with_files
from twbal.cli.stages.regress import _read as read_baseline
from twbal.cli.stages.regress import _tolerances as read_tolerances
from twbal.diagnosis.diagnosis_file import closed_share
from twbal.effects.library import all_effects

SIM = {"physics_step": 0.001, "effects": {"dead_zone": {"width": 1.2}, "torque_gain": {"gain": 0.8}}}
TOLERANCES = {"*": {"relative": 1e-7, "absolute": 1e-10}, "fit/*": {"relative": 0.1, "absolute": 0.0}}
ITERATION = {
    "index": 0, "real_episodes": 1, "real_samples": 10, "real_seconds": 0.2, "predicted_cost": 3.0, "real_cost": 2.0,
    "successes": 1, "trials": 2, "coverage95": 0.9, "fit_s": 1.0, "search_s": 1.0, "drift_m": None,
    "judged_success": 1.0, "policy": {"path": "policy.pt", "sha256": "a1"}, "note": "",
}  # fmt: skip
SUMMARY = {
    "robot": "paper",
    "seed": 0,
    "wall_s": 3.0,
    "sim": {"episodes": 3, "samples": 30},
    "iterations": [ITERATION],
    "best_iteration": 0,
}
FILE = {"path": "a.mcap", "sha256": "a1"}
MANIFEST = {
    "stage": "diagnose", "complete": True, "fingerprint": "a1", "seed": 0, "settings": "a: 1\n",
    "inputs": {"episodes": [FILE]}, "outputs": [FILE], "versions": {"twbal": "1"}, "started": "now", "wall_s": 3.0,
}  # fmt: skip
BASELINE = {"data": {"policy.pt": "a1"}, "version": "1", "measures": {"logs/samples": 3.0, "logs/outcome": "completed"}}
DIAGNOSIS = {"gap": {"closed": 0.5}}

OF_YAML = "{}[]:,-&*!<>?|%@#'\"\\ \n\tab01.~${}_"


def sim(path: Path):
    words = with_files([f"sim={path}"])
    names = [word.removeprefix("++sim.effects.").partition("=")[0] for word in words[1:] if "effects" in word]
    assert set(names) <= set(all_effects())
    assert all("_target_:twbal.effects." in word for word in words if word.startswith("++"))
    return words


def read_yaml_files(path):
    as_yaml = path.with_suffix(".yaml")
    ours_only(sim, as_yaml)
    ours_only(read_tolerances, as_yaml)


def read_json_files(path):
    for reader in (read_summary, closed_share, read_baseline):
        ours_only(reader, path)
    path.rename(path.with_name("manifest.json"))
    ours_only(read_manifest, path.parent)


@fuzzed(data=st.binary(max_size=200) | st.text(OF_YAML, max_size=200).map(str.encode))
def test_random_bytes(path, data):
    path.with_suffix(".yaml").write_bytes(data)
    read_yaml_files(path)
    path.write_bytes(data)
    read_json_files(path)


@fuzzed(data=st.sampled_from([yaml.safe_dump(SIM).encode(), yaml.safe_dump(TOLERANCES).encode()]).flatmap(mutated))
def test_yaml_with_bytes_changed(path, data):
    path.with_suffix(".yaml").write_bytes(data)
    read_yaml_files(path)


@fuzzed(tree=st.sampled_from([SIM, TOLERANCES]).flatmap(changed))
def test_yaml_with_a_value_changed(path, tree):
    path.with_suffix(".yaml").write_text(yaml.safe_dump(tree, allow_unicode=True), encoding="utf-8")
    read_yaml_files(path)


RECORDS = [SUMMARY, MANIFEST, BASELINE, DIAGNOSIS]


@fuzzed(data=st.sampled_from([json.dumps(record).encode() for record in RECORDS]).flatmap(mutated))
def test_json_with_bytes_changed(path, data):
    path.write_bytes(data)
    read_json_files(path)


@fuzzed(record=st.sampled_from([*RECORDS, ITERATION]).flatmap(changed))
def test_json_with_a_value_changed(path, record):
    whole = {**SUMMARY, "iterations": [record]} if isinstance(record, dict) and "index" in record else record
    path.write_text(json.dumps(whole))
    read_json_files(path)


@fuzzed(deep=st.integers(1, 200_000), opening=st.sampled_from(["[", '{"a":', "- ", "{a: "]), tree=plain)
def test_any_depth(path, deep, opening, tree):
    path.write_text(opening * deep + json.dumps(tree))
    path.with_suffix(".yaml").write_text(opening * deep + json.dumps(tree))
    read_yaml_files(path)
    read_json_files(path)


def test_the_files_that_are_changed_are_whole(tmp_path):
    for name, tree in (("sim.yaml", SIM), ("tolerances.yaml", TOLERANCES)):
        (tmp_path / name).write_text(yaml.safe_dump(tree))
    assert len(sim(tmp_path / "sim.yaml")) == 4
    assert len(read_tolerances(tmp_path / "tolerances.yaml")) == 2
    for name, tree in (("s", SUMMARY), ("b", BASELINE), ("d", DIAGNOSIS), ("manifest.json", MANIFEST)):
        (tmp_path / name).write_text(json.dumps(tree))
    assert read_summary(tmp_path / "s").seed == 0
    assert read_baseline(tmp_path / "b").version == "1"
    assert closed_share(tmp_path / "d") == 0.5
    assert read_manifest(tmp_path).complete
