"""Whether tilt and wheels are of one row, and turns of one size, on a planar robot that a regulator shakes."""

import numpy as np
import pytest

from twbal.core.start_pose import StartPose
from twbal.io.importers.checks.all_checks import doubts
from twbal.io.importers.checks.doubt import DoubtKind, LogPart
from twbal.io.importers.checks.wheel_sides import side_doubts
from twbal.planar.planar_plant import PlanarPlant

PERIODS = 1500


@pytest.fixture(scope="module")
def driven(paper):
    """Readings (T, 7) of a robot that stays upright, and its commands (T - 1,)."""
    rng = np.random.default_rng(2)
    start = StartPose(0.05, 0.0, 0.0, 0.0)
    with PlanarPlant(robot=paper, effects=[], start=start, physics_step=0.002, seed=0) as plant:
        seen, commands = [plant.reset(0)], []
        for push in np.repeat(rng.normal(0.0, 2.0, PERIODS // 15), 15):
            now = seen[-1]
            speed = paper.wheel_radius * (now.wheel_rate + now.tilt_rate)
            commands.append(80 * now.tilt + 14 * now.tilt_rate + 6 * speed + push)
            seen.append(plant.step(commands[-1]))
    return np.array(seen), np.array(commands)


def rows(driven, paper, wheel_rate):
    """Doubts on rows of a log whose wheels have a rate alone."""
    seen, commands = driven
    rng, period = np.random.default_rng(5), paper.control_period
    noises = {"tilt": 0.002, "tilt_rate": 0.01}
    signals = {name: seen[:, i] for i, name in ((1, "tilt"), (2, "tilt_rate"))}
    signals = {name: values + noises[name] * rng.standard_normal(len(seen)) for name, values in signals.items()}
    signals["wheel_rate"] = wheel_rate
    signals = {name: values[3:] for name, values in signals.items()}
    part = LogPart(period, signals, commands[3:], {}, False, False, paper)
    return [doubt.sentence for doubt in doubts({"time": seen[3:, 0], **signals}, part) if doubt.kind is DoubtKind.ROW]


def test_a_rate_that_is_differenced_from_counts_is_half_a_row_late_and_no_doubt(driven, paper):
    counts = np.round(driven[0][:, 4] / 0.0002) * 0.0002
    assert rows(driven, paper, np.diff(counts, prepend=counts[:1]) / paper.control_period) == []


def test_a_rate_of_the_row_before_is_doubted(driven, paper):
    (sentence,) = rows(driven, paper, np.roll(driven[0][:, 5], 1))
    assert "after tilt: is one of them from another row, or filtered?" in sentence


@pytest.mark.parametrize("wrong", ["tilt", "tilt_rate", ""])
def test_a_wrong_sign_of_tilt_or_gyro_does_not_make_the_time_unknown(wrong, driven, paper):
    seen, commands = driven
    signals = {"tilt": seen[:, 1], "tilt_rate": seen[:, 2], "wheel_angle": seen[:, 4]}
    signals |= {wrong: -signals[wrong]} if wrong else {}
    part = LogPart(paper.control_period, signals, commands, {}, False, False, paper)
    found = list(doubts({"time": seen[:, 0], **signals}, part))
    assert [doubt.quantity for doubt in found if doubt.kind is DoubtKind.SIGN] == [wrong] * bool(wrong)
    assert not any("time is right" in doubt.sentence for doubt in found)
    without = {name: values for name, values in signals.items() if name != "tilt_rate"}
    told = [each.sentence for each in doubts({"time": seen[:, 0], **without}, part._replace(signals=without))]
    assert any("time is right" in sentence for sentence in told)


def turning(driven, paper, size):
    """Doubts on the sides of a log of that robot, turning to and fro, whose yaw rate is `size` times too large."""
    seen, commands = driven
    rng, time = np.random.default_rng(6), seen[:, 0]
    heading = 0.5 * np.sin(0.8 * time)
    apart = 0.5 * heading * paper.track / paper.wheel_radius
    sides = {"wheel_angle": (seen[:, 4] - apart, seen[:, 4] + apart)}
    yaw_rate = size * (0.4 * np.cos(0.8 * time) + 0.01 * rng.standard_normal(len(time)))
    signals = {"tilt": seen[:, 1], "tilt_rate": seen[:, 2], "wheel_angle": seen[:, 4], "yaw_rate": yaw_rate}
    return list(side_doubts(LogPart(paper.control_period, signals, commands, sides, False, False, paper)))


@pytest.mark.parametrize("size", [0.5, 1.0, 2.0])
def test_turns_about_as_far_as_the_wheels_tell_are_no_doubt(driven, paper, size):
    assert turning(driven, paper, size) == []


@pytest.mark.parametrize("size", [180.0 / np.pi, np.pi / 180.0])
def test_a_yaw_rate_in_another_unit_is_doubted(driven, paper, size):
    (doubt,) = turning(driven, paper, size)
    assert doubt.kind is DoubtKind.UNIT and doubt.quantity == "yaw_rate"
    assert f"the robot turns {size:.2g} times as far by its yaw_rate" in doubt.sentence


def standing(driven, paper, unit, offset=0.0, swing=0.01, noise=0.02):
    """Doubts on the sides of a log of that robot, which hardly turns, with a noisy yaw rate in another unit."""
    seen, commands = driven
    rng, time = np.random.default_rng(7), seen[:, 0]
    apart = 0.5 * swing * np.sin(0.8 * time) * paper.track / paper.wheel_radius
    sides = {"wheel_angle": (seen[:, 4] - apart, seen[:, 4] + apart)}
    yaw_rate = unit * (0.8 * swing * np.cos(0.8 * time) + offset + noise * rng.standard_normal(len(time)))
    signals = {"tilt": seen[:, 1], "tilt_rate": seen[:, 2], "wheel_angle": seen[:, 4], "yaw_rate": yaw_rate}
    return LogPart(paper.control_period, signals, commands, sides, False, False, paper)


@pytest.mark.parametrize(("offset", "noise"), [(0.0, 0.1), (0.1, 0.02), (0.1, 0.0)])
def test_a_yaw_rate_in_degrees_is_doubted_also_where_it_is_offset_and_noise(offset, noise, driven, paper):
    """6 "rad/s" throughout."""
    part = standing(driven, paper, 180.0 / np.pi, offset, noise=noise)
    (doubt,) = (doubt for doubt in side_doubts(part) if doubt.kind is DoubtKind.UNIT)
    assert doubt.quantity == "yaw_rate" and "another unit" in doubt.sentence
    (note,) = side_doubts(part._replace(sides={}))  # of one wheel alone nobody can tell
    assert note.kind is DoubtKind.UNTOLD and "Log both wheels" in note.sentence


@pytest.mark.parametrize(("offset", "noise"), [(0.0, 0.3), (0.35, 0.05), (-0.2, 0.2)])
def test_offset_and_noise_of_a_gyro_are_no_doubt(offset, noise, driven, paper):
    part = standing(driven, paper, 1.0, offset, noise=noise)
    assert [doubt for doubt in side_doubts(part) if doubt.kind is not DoubtKind.UNTOLD] == []
    assert list(side_doubts(part._replace(sides={}))) == []


@pytest.mark.parametrize("quantity", ["wheel_angle", "wheel_rate"])
@pytest.mark.parametrize("right", [1.0, -1.0])
def test_a_wheel_that_counts_backward_is_named_by_angles_and_by_rates(right, quantity, driven, paper):
    """The wheels differ by some noise, without which their mean would be 0."""
    seen, commands = driven
    turned = seen[:, {"wheel_angle": 4, "wheel_rate": 5}[quantity]]
    noise = 0.01 * np.ptp(turned) * np.random.default_rng(8).standard_normal(turned.shape)
    sides = turned, right * turned + noise
    signals = {"tilt": seen[:, 1], "tilt_rate": seen[:, 2], quantity: 0.5 * (sides[0] + sides[1])}
    part = LogPart(paper.control_period, signals, commands, {quantity: sides}, False, False, paper)
    found = [doubt.sentence for doubt in side_doubts(part) if doubt.kind is DoubtKind.SIGN]
    assert len(found) == (right < 0)
    assert all("count against each other" in sentence and "[s, -s]" in sentence for sentence in found)


def scaled(driven, paper, **factors):
    """Sentences on the units of a log of that robot, turning to and fro, with quantities a factor too large."""
    seen, commands = driven
    time = seen[:, 0]
    apart = 0.25 * np.sin(0.8 * time) * paper.track / paper.wheel_radius
    of_angle = factors.get("wheel_angle", 1.0)
    signals = {name: seen[:, k] for name, k in (("tilt", 1), ("tilt_rate", 2), ("wheel_angle", 4), ("wheel_rate", 5))}
    signals = {name: factors.get(name, 1.0) * values for name, values in signals.items()}
    signals["yaw_rate"] = 0.4 * np.cos(0.8 * time)
    sides = {"wheel_angle": (of_angle * (seen[:, 4] - apart), of_angle * (seen[:, 4] + apart))}
    part = LogPart(paper.control_period, signals, commands, sides, False, False, paper)
    return [doubt.sentence for doubt in doubts({"time": time, **signals}, part) if doubt.kind is DoubtKind.UNIT]


@pytest.mark.parametrize("factor", [0.25, 0.5, 2.0, 4.0])
@pytest.mark.parametrize("quantity", ["wheel_angle", "wheel_rate"])
def test_an_encoder_whose_edges_are_counted_otherwise_is_said_once(factor, quantity, driven, paper):
    (sentence,) = scaled(driven, paper, **{quantity: factor})
    of_rate = factor if quantity == "wheel_rate" else 1.0 / factor
    assert f"wheel_rate is {of_rate:.3g} times as fast as wheel_angle changes" in sentence
    assert "encoders count 1, 2 or 4 edges a line: is the scale off by that" in sentence


def test_a_scale_of_edges_hides_no_wheels_that_are_off_otherwise(driven, paper):
    both = scaled(driven, paper, wheel_angle=60.0, wheel_rate=15.0)
    assert len(both) > 1 and any("data sheet" in sentence for sentence in both)


def test_wheels_without_a_rate_may_be_off_by_edges(driven, paper):
    seen, commands = driven
    signals = {"tilt": seen[:, 1], "tilt_rate": seen[:, 2], "wheel_angle": 4.0 * seen[:, 4]}
    part = LogPart(paper.control_period, signals, commands, {}, False, False, paper)
    said = [doubt.sentence for doubt in doubts({"time": seen[:, 0], **signals}, part) if doubt.kind is DoubtKind.UNIT]
    assert any("encoders count 1, 2 or 4 edges a line" in sentence for sentence in said)
