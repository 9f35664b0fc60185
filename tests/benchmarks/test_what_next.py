"""The benchmark of suggested experiments: its robots share no code with the diagnosis, but its law is that of twbal."""

import ast
from pathlib import Path

import numpy as np
import pytest
from hydra import compose
from hydra.utils import instantiate

from benchmarks.other_robots.recording import driven
from benchmarks.other_robots.sets import designed
from benchmarks.what_next import recording
from benchmarks.what_next.tables import what_next, what_next_figures
from twbal.cli.composition import composing
from twbal.io.logs import read_episode

FORBIDDEN = ("twbal.sim", "twbal.planar", "twbal.effects", "twbal.sysid", "twbal.diagnosis", "twbal.search")
SURE = {"open": False, "named": [["dead_zone", True]], "missed": []}
OPEN = {"open": True, "named": [], "missed": ["dead_zone"]}


def test_what_records_shares_no_code_with_what_diagnoses():
    for node in ast.walk(ast.parse(Path(recording.__file__).read_text())):
        names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
        names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        assert not any(name.startswith((*FORBIDDEN, "twbal.policies")) for name in names)


@pytest.fixture(scope="module")
def small():
    """A set, its sheet, and the robot as it was driven."""
    each = designed("clean", 4)._replace(excitation="E", sensors="ideal", sheet="paper", rate=50)
    with composing():
        sheet = instantiate(compose("sim_collect", ["robot=paper"]).robot)
    return each, sheet, driven(each, sheet)


@pytest.mark.slow
def test_the_suggested_command_is_followed_by_its_own_regulator(small):
    _, sheet, recorded = small
    with composing():
        told = instantiate(compose("real_rollout", ["experiment=excite", "policy.command_width=0.1"]).policy)
    law = recording._law(recorded.law, sheet, 0.1)
    assert (-law.tilt, -law.rate, -law.speed) == pytest.approx(told.gain, rel=1e-3)
    assert (law.limit, law.fade) == (told.max_command, told.fade_tilt)


@pytest.mark.slow
def test_the_same_robot_is_recorded_anew_under_the_settings_of_the_command(small, tmp_path):
    each, sheet, recorded = small
    settings = {"policy.command_width": 0.1, "policy.multisine": 0.0, "policy.prbs": 0.0, "policy.speed": 0.3}
    assert recording.suggested(each, sheet, recorded, settings, tmp_path) == pytest.approx(recording.SECONDS)
    quiet = read_episode(tmp_path / "suggested" / "episodes" / "suggested.mcap")
    recording.suggested(each, sheet, recorded, settings | {"policy.prbs": 0.1}, tmp_path)
    shaken = read_episode(tmp_path / "suggested" / "episodes" / "suggested.mcap")
    assert np.std(shaken.commands) > 2.0 * np.std(quiet.commands)


def test_the_table_counts_a_set_without_a_suggestion_as_not_decided():
    said = {"separation": 20.0, "repetition": 2.0, "settings": {}}
    rows = [
        {"way": "quiet", "first": OPEN, "next": said, "seconds_up": 10.0, "repetition": OPEN, "suggested": SURE},
        {"way": "usual", "first": OPEN, "next": None, "repetition": SURE},
        {"way": "usual", "first": SURE, "next": None},
    ]
    lines = what_next({"sets": rows})
    assert lines[2].startswith("| all, a repetition | 2 | 1 of 2")
    assert lines[3].startswith("| all, the suggested experiment | 2 | 1 of 2")
    figures = "\n".join(what_next_figures({"sets": rows}))
    assert "| left open by the first recording | 2 of 3" in figures
    assert "| of these, the hidden robot falls in it | 0 of 1" in figures
    assert "| of these, all of it right | 1 of 1" in figures
    assert "| decided by the suggested experiment alone, and all of it right | 1 of 1" in figures
    assert "| decided by the repetition alone | 0 of 1" in figures
