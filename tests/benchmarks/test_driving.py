"""Whether driving is judged rightly, on motions that were made up, and whether pushes are as strong as they say."""

import json
from functools import cache
from math import cos, pi, radians, sin

import numpy as np
import pytest
from hydra import compose
from hydra.utils import instantiate

from benchmarks.driving.__main__ import learned, main
from benchmarks.driving.judging import Driven, farthest, from_start, heading_errors, measured_of, passed, speed_errors
from benchmarks.driving.pushed import PushedOnce
from benchmarks.driving.tables import driving, misses
from benchmarks.driving.tasks import PAPER_SPEEDS, Push, tasks
from twbal.cli.composition import composing
from twbal.core.course import Course
from twbal.core.reference import Reference

LIMIT = 0.5236


@cache
def sheet_of(name):
    with composing():
        return instantiate(compose("drive", [f"robot={name}", "policy.path=none"]).robot)


def course(*segments):
    return Course.from_settings(sheet_of("paper"), segments).segments


def motion(segments, x, y=0.0, heading=0.0, tilt=0.0, until=None):
    """Poses by functions of time, or constants."""
    times = np.arange(0.0, (until or segments[-1].end) + 0.01, 0.02)
    columns = [np.array([f(t) if callable(f) else f for t in times]) for f in (x, y, heading, tilt)]
    return Driven(times, np.column_stack(columns), segments, LIMIT)


@pytest.mark.parametrize("heading", [0.0, 2.5, -3.0])
def test_the_speed_error_is_that_along_the_robots_own_way_whichever_way_it_looks(heading):
    segments = course({"seconds": 10.0, "speed": 0.5}, {"seconds": 10.0, "speed": -0.5})

    def place(time):
        return 0.45 * min(time, 10.0) - 0.52 * max(time - 10.0, 0.0)

    driven = motion(segments, lambda t: place(t) * cos(heading), lambda t: place(t) * sin(heading), heading)
    assert speed_errors(driven) == pytest.approx([-10.0, 4.0], abs=1e-6)


def test_only_the_end_of_a_ramp_counts():
    segments = course({"seconds": 14.0, "speed": 0.5})
    driven = motion(segments, lambda t: 0.5 * max(t - 5.5, 0.0))  # it stands for 5.5 s
    assert speed_errors(driven) == pytest.approx([0.0], abs=1e-6)


def test_a_robot_that_circles_drives_as_fast_as_its_wheels():
    segments = course({"seconds": 10.0, "speed": 0.5})
    driven = motion(segments, lambda t: 0.5 * sin(t), lambda t: 0.5 * (1 - cos(t)), lambda t: t)
    assert speed_errors(driven) == pytest.approx([0.0], abs=0.01)


def test_headings_are_told_after_each_turn_without_jumps():
    stand = {"seconds": 4.0, "speed": 0.0}
    segments = course(stand, {"turn": 170.0}, stand, {"turn": 90.0}, stand)
    first, second = segments[1].end, segments[3].end

    def heading(time):
        turned = radians(168.0) * (time > first) + radians(93.0) * (time > second)
        return (turned + pi) % (2 * pi) - pi  # as a simulation may tell it

    assert heading_errors(motion(segments, 0.0, 0.0, heading)) == pytest.approx([2.0, 1.0])


def test_a_square_is_closed_where_the_robot_was_put():
    driven = motion(course({"seconds": 2.0, "speed": 0.0}), 0.03, 0.04)
    assert from_start(driven) == pytest.approx(0.05)
    assert passed("square", [0.149], 0.15) and not passed("square", [0.151], 0.15)


def test_a_place_counts_where_the_robot_is_to_stand():
    stand = {"seconds": 8.0, "speed": 0.0}
    segments = course(stand, {"position": 1.0}, stand)

    def place(time):
        if time < 4.9:
            return -0.5 if time else 0.0  # while it comes to its place, which does not count
        return 0.1 if time < segments[1].end else 0.8

    assert farthest(motion(segments, place)) == pytest.approx(0.2)


@pytest.mark.parametrize(("tilt", "until"), [(0.6, None), (0.0, 5.0)])
def test_a_robot_that_leans_too_far_or_whose_rollout_ends_early_fell(tilt, until):
    segments = course({"seconds": 8.0, "speed": 0.0})
    assert not motion(segments, 0.0, tilt=lambda t: tilt if 3.0 < t < 3.1 else 0.0, until=until).stood_up
    assert motion(segments, 0.0).stood_up


def test_the_worst_direction_decides():
    assert passed("ramp", [-4.9, 4.9], 0.15) and not passed("ramp", [1.0, -5.1], 0.15)
    assert passed("turns", [2.9, 2.9], 0.15) and not passed("turns", [2.9, 3.1], 0.15)
    assert passed("slope", [0.29], 0.15) and not passed("slope", [0.31], 0.15)


def perfect(task):
    """A robot that is a control period behind the reference, and never off it."""
    times = np.arange(0.0, task.course.duration + 0.1, 0.1)
    reference, poses = Reference(task.course), []
    for time in times.tolist():
        place = reference.follow(time, *reference.motion[:2]).position
        poses.append((place, 0.0, 0.0, 0.0))
    return Driven(times, np.array(poses), task.course.segments, LIMIT)


@pytest.mark.parametrize("name", ["paper", "regbot", "balboa", "esp32"])
def test_a_robot_that_is_where_its_reference_is_passes_all_ramps_of_its_sheet(name):
    sheet = sheet_of(name)
    asked = list(tasks(sheet))
    assert [task.name for task in asked] == [*["ramp"] * 3, "turns", "square", *["push"] * 2, *["slope"] * 2]
    for task in asked[:3]:
        assert measured_of("ramp", perfect(task)) == pytest.approx([0.0, 0.0], abs=1e-3)
    assert {task.push.impulse for task in asked if task.push} == {sheet.body_mass, -sheet.body_mass}  # 10 N·s on 10 kg


def test_the_paper_robot_is_asked_for_the_speeds_of_the_issue():
    fastest = [
        max(segment.target.speed or 0.0 for segment in task.course.segments) for task in tasks(sheet_of("paper"))
    ]
    assert tuple(fastest[:3]) == PAPER_SPEEDS


def test_a_push_gives_the_robot_its_impulse_once():
    forces = []

    class Counted:
        control_period, push = 0.02, 0.0

        def reset(self, trial):
            forces.clear()

        def step(self, command):
            forces.append(self.push)

    plant = PushedOnce(Counted(), Push(0.5, -10.0))
    for trial in (0, 1):
        plant.reset(trial)
        for _ in range(100):
            plant.step(0.0)
        assert sum(forces) * 0.02 == pytest.approx(-10.0)
        assert np.flatnonzero(forces).tolist() == [25, 26, 27, 28, 29]


def done(name, choice, did, fell=False, measured=()):
    return {"name": name, "choice": choice, "passed": did, "fell": fell, "measured": list(measured), "seconds": 7.25}


def test_tables_count_what_was_done_and_list_what_was_missed():
    first = [done("ramp", "0.3 m/s", True, measured=[-1.0, 2.0]), done("push", "forward", False, fell=True)]
    second = [done("ramp", "0.3 m/s", False, measured=[-6.0, 1.0]), done("push", "forward", True)]
    results = {"moderate": [{"seed": 7, "tasks": first}, {"seed": 8, "wheels_larger": -2.0, "tasks": second}]}
    _, _, robots, ramp, push = driving(results)
    assert robots == "| robots | 2 |" and push.endswith("| 1 of 2 |")
    assert "0.3 m/s: 1 of 2; 4.0 / 6.0 %" in ramp and "fell" not in ramp
    assert misses(results)[2:] == [
        "| moderate 7 | push forward: fell after 7.2 s |",
        "| moderate 8 | ramp 0.3 m/s: -6.0, 1.0 % (wheels -2.0 %) |",
    ]
    del results["moderate"][1]["wheels_larger"]  # as in older results
    assert misses(results)[3] == "| moderate 8 | ramp 0.3 m/s: -6.0, 1.0 % |"


def test_only_robots_that_are_learned_are_driven(tmp_path):
    for seed, parts in ((9, ("result.json",)), (10, ()), (11, ("result.json",)), (12, ("result.json",))):
        folder = tmp_path / "hard" / "default" / f"robot_{seed}"
        folder.mkdir(parents=True)
        for part in parts:
            (folder / part).write_text(json.dumps({}))
    assert learned(tmp_path, "hard", 3) == [9, 11]


@pytest.mark.parametrize("words", [["family=soft"], ["robot=3"], ["robots=many"]])
def test_settings_that_are_none_are_refused(words):
    with pytest.raises(SystemExit, match="Settings are family"):
        main(words)


def test_nothing_to_drive_is_said(tmp_path):
    with pytest.raises(SystemExit, match="No robot is learned"):
        main([f"policies={tmp_path}"])
