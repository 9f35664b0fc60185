"""The benchmark of Algorithm 1 over the firmware: what it asks for, and what its table says."""

import json
from pathlib import Path

import pytest
from hydra import compose

from benchmarks.on_firmware.__main__ import TARGET, VIRTUAL, WAYS, hidden, learned, words
from benchmarks.on_firmware.tables import on_firmware, updates
from twbal.cli.composition import composing

BUILD = Path("/some folder/it's/build")


@pytest.mark.parametrize("way", WAYS)
def test_every_way_leads_to_the_same_robot(way):
    with composing():
        cfg = compose("iterate", words(hidden("moderate_840"), way, BUILD))
    assert (cfg.link.seed, cfg.seed, cfg.link.clock) == (840, 840, "lockstep")
    assert list(cfg.link.overrides) == ["idle_timeout=300", "faults=moderate"]
    assert cfg.link.get("on_board", False) == (way == "on_board")
    assert cfg.link.get("program") == (None if way == VIRTUAL else str(BUILD / "robot_posix"))


def test_a_program_is_built_where_it_is_started(tmp_path):
    """The shell takes the command apart as it was put together."""
    with composing():
        deploy = compose("iterate", words(hidden("hard_743"), "on_board", BUILD)).link.deploy
    assert deploy.startswith('make -s -C firmware POLICY="$POLICY_FOLDER" BUILD=')
    assert deploy.endswith("""'/some folder/it'"'"'s/build'""")


@pytest.mark.parametrize("name", ["balboa_915", "hard", "unknown_1"])
def test_other_robots_are_refused(name):
    with pytest.raises((KeyError, ValueError)):
        hidden(name)


def iterations(*successes):
    return [{"index": index, "successes": count} for index, count in enumerate(successes)]


def test_updates_are_counted_up_to_the_first_policy_all_of_whose_trials_succeed():
    assert updates(iterations(0, 9, 10, 10)) == 2
    assert updates(iterations(10, 8)) == 0
    assert updates(iterations(9, 9)) is None


def test_a_robot_that_was_not_driven_in_every_way_is_told(tmp_path):
    ways = {"virtual": {"iterations": iterations(0, 10, 10)}}
    ways["host"] = {"iterations": iterations(0, 9), "same": {"artefacts": [7, 50], "policies": [2, 4]}}
    *_, row = on_firmware({"hard_743": ways})
    assert row == "| hard 743 | 1 (0, 10, 10) | never (0, 9) | not run | 7 of 50 | - | - |"


def test_the_results_are_as_many_updates_in_every_way_and_the_same_bits_by_the_host():
    results = json.loads(TARGET.read_text())
    assert len(results) >= 3
    for robot, ways in results.items():
        assert {updates(ways[way]["iterations"]) for way in WAYS} == {updates(ways[VIRTUAL]["iterations"])}, robot
        same, count = ways["host"]["same"]["artefacts"]
        assert same == count > 20, robot
        assert ways["on_board"]["on_board"], robot


def test_it_asks_for_no_run_that_is_there(tmp_path, monkeypatch):
    """A finished run is not built for again."""
    monkeypatch.setattr("subprocess.run", lambda *words, **settings: pytest.fail("it runs something"))
    monkeypatch.setattr("benchmarks.on_firmware.__main__.iterate", lambda folder, words: {"iterations": []})
    for way in ("virtual", "host"):
        run = tmp_path / way / "run"
        run.mkdir(parents=True)
        (run / "summary.json").write_text("{}")
        (run / "artefacts.sha256").write_text(
            "aa  a/policy.pt\n" + ("bb" if way == "host" else "cc") + "  a/model.pt\n"
        )
    made = learned(hidden("default"), "host", tmp_path / "host", 6)
    assert made == {"iterations": [], "on_board": [], "same": {"artefacts": [1, 2], "policies": [1, 1]}}
