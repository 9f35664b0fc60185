"""The right model on data that nothing was fitted to: the planar model makes them at fine steps, PyBullet is tried."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter
from synthetic_recordings import NOISE, synthetic_recording

from twbal.core.plant import Observation
from twbal.diagnosis.filter_result import filter_recordings
from twbal.diagnosis.gap import Models, measure_gaps, rollout_error
from twbal.diagnosis.rollouts_from_recordings import RolloutStarts
from twbal.effects.library import effects_from
from twbal.sim.replay import replay
from twbal.sysid.held_out import held_out
from twbal.sysid.model import Data
from twbal.sysid.noise import NoiseModel
from twbal.sysid.recording import MEASURED

LASTING = {
    "periodic_disturbance": {"force": 3.0, "frequency": 0.73, "phase": 2.0},
    "cable_spring": {"stiffness": 6.0},
    "battery_sag": {"rate": 0.02},
    "ground_waves": {"slope": 0.01, "waves": 0.7, "phase": 0.5},
}
"""Effects that depend on the time, the place or the charge since a recording began."""

LEVELS = np.array([NOISE[name] for name in MEASURED])
COLUMNS = [Observation._fields.index(name) for name in MEASURED]
SUBSTEPS = 10


@pytest.fixture(scope="module")
def split(paper):
    return held_out([synthetic_recording(paper, LASTING, seed=3, periods=1600, tolerance=0.0)], 0.25)


@pytest.fixture(scope="module")
def seen(paper, split):
    """What the right model makes of the end of a recording whose beginning was fitted."""
    noise = NoiseModel(LEVELS, np.array([0.01, 0.01]))
    return filter_recordings(paper, LASTING, noise, 0.0, split.kept_back, SUBSTEPS)


def gaps_of(models, kept_back, robot, steps, starts=40):
    """The gaps of rollouts in PyBullet over some control periods."""
    stretches, engine = RolloutStarts(5, 5, starts, steps), partial(run, robot)
    return measure_gaps(models, kept_back, engine, [steps], stretches, LEVELS, robot.wheel_radius)


def test_the_right_model_predicts_the_end_of_a_recording_as_well_as_its_beginning(split, seen):
    counts = split.kept_back[0].usable
    early, late = (np.sqrt(np.mean(seen.errors[0][rows][20:] ** 2, axis=0)) for rows in (~counts, counts))
    np.testing.assert_allclose(late, early, rtol=0.15)


def test_in_pybullet_it_leaves_no_more_than_noise_on_the_end_of_a_recording(paper, split, seen):
    engine = partial(run, paper)
    gaps = measure_gaps(
        Models(seen, seen, seen),
        split.kept_back,
        engine,
        [3, 7],
        RolloutStarts(5, 5, 40, 7),
        LEVELS,
        paper.wheel_radius,
    )
    assert {(gap.channel, round(gap.horizon, 2)) for gap in gaps} == {(c, h) for c in MEASURED for h in (0.06, 0.14)}
    for gap in gaps:
        assert gap.after < 1.3 * gap.noise_floor, gap


@pytest.mark.parametrize("off", [0.02, 0.0])
def test_a_value_that_the_data_leave_open_makes_no_more_than_its_standard_error_says(off, paper, split, seen):
    """All is right but the slope of the floor, by one standard error; without an error nothing is worked out."""
    sloping = replace(seen, effects={**LASTING, "ground_slope": {"angle": off}})
    drawn = [{**LASTING, "ground_slope": {"angle": angle}} for angle in (0.0, 2.0 * off)]
    gaps = gaps_of(Models(seen, seen, sloping, drawn), split.kept_back, paper, 7)
    (tilt,) = (gap for gap in gaps if gap.channel == "tilt")
    assert (tilt.after > 2.0 * tilt.noise_floor) == (off > 0.0)
    assert tilt.after == pytest.approx(tilt.expected, rel=0.15 if off else 0.3)
    assert (tilt.parameter_floor > 0.0) == (off > 0.0)
    assert tilt.is_near_floor(tilt.after) and tilt.interval_scale < 1.2


def test_rollouts_of_a_filtered_tilt_begin_at_what_the_filter_showed(paper):
    """An accelerometer's noise drives such a filter off by 8 mrad, which lasts, and which no simulation knows of."""
    rate, off, rng = 1.5, 0.008, np.random.default_rng(4)
    filtered = {"tilt_filter": {"rate": rate, "lead": 0.0}}
    recording = synthetic_recording(paper, filtered, seed=4, periods=1600, tolerance=0.0)
    stays = np.exp(-rate * recording.period)
    error = lfilter([1.0], [1.0, -stays], np.sqrt(1.0 - stays**2) * off * rng.standard_normal(len(recording) + 1))
    measured = recording.measured.copy()
    measured[:, MEASURED.index("tilt")] += error
    kept_back = held_out([replace(recording, measured=measured)], 0.25).kept_back
    noise = NoiseModel(LEVELS, np.array([0.01, 0.01]), np.array([1e-9, 1e-9, off, 1e-9, 1e-9, 1e-9]))
    seen = filter_recordings(paper, filtered, noise, 0.0, kept_back, SUBSTEPS)
    gaps = gaps_of(Models(seen, seen, seen), kept_back, paper, 3)
    (tilt,) = (gap for gap in gaps if gap.channel == "tilt")
    assert tilt.after < 0.6 * off
    assert tilt.excess == 0.0  # all three are one model


@pytest.mark.parametrize("effects", [{"tilt_filter": {"rate": 0.6, "lead": 0.004}}, {"gyro_bias": {"rate": 0.02}}])
@pytest.mark.parametrize("late", [{}, {"imu_delay": {"delay": 0.03}}])
def test_rollouts_are_those_of_sensors_that_remember_the_whole_past(paper, effects, late, monkeypatch):
    effects = {**effects, **late}
    recording = synthetic_recording(paper, effects, seed=6, periods=800, tolerance=0.0)
    kept_back = held_out([recording], 0.25).kept_back
    seen = filter_recordings(paper, effects, NoiseModel(LEVELS, np.array([0.01, 0.01])), 0.0, kept_back, SUBSTEPS)

    def errors():
        gaps = gaps_of(Models(seen, seen, seen), kept_back, paper, 5, starts=12)
        return [(gap.after, gap.noise_floor) for gap in gaps]

    short = errors()
    monkeypatch.setattr("twbal.diagnosis.rollouts_from_recordings._IMU_MEMORY", 1e3)
    np.testing.assert_allclose(short, errors(), rtol=1e-9)


def test_worse_is_what_is_worse_rollout_by_rollout(split, seen, paper):
    """A model that is off by a fifth more everywhere is worse; one with one rollout to blame may be so by chance."""
    rng = np.random.default_rng(5)

    def gap_of(*offs):
        """With rollouts of nominal, refitted and named model whose tilt is off by these, (40,) each."""
        given = iter(offs)

        def off(result, starts, commands):
            courses = np.zeros((len(starts), commands.shape[1] + 1, 7))
            if len(starts) == 40:  # else the floor is found
                at = [start.past_commands.shape[0] for start in starts]
                courses[:, :, COLUMNS] = np.array([measured[t : t + commands.shape[1] + 1] for t in at])
                courses[:, :, COLUMNS[0]] += next(given)[:, None]
            return courses

        measured = split.kept_back[0].measured
        models = Models(seen, seen, replace(seen))
        found = measure_gaps(models, split.kept_back, off, [3], RolloutStarts(5, 5, 40, 3), LEVELS, paper.wheel_radius)
        return found[0]

    usual = 0.01 * rng.standard_normal(40)
    assert gap_of(usual, usual, 1.2 * usual).is_worse
    by_chance = gap_of(usual, usual, usual * np.where(np.arange(40) == np.argmax(np.abs(usual)), 1.6, 1.0))
    assert by_chance.after > 1.05 * by_chance.before
    assert not by_chance.is_worse


def diverged(seen, instant):
    """The same with a filter that has diverged from an instant on."""
    (path,) = seen.trajectories
    lost = np.arange(len(path.tilt)) >= instant
    return replace(seen, trajectories=(replace(path, tilt=np.where(lost, np.nan, path.tilt)),))


@pytest.mark.parametrize("which", range(3))
def test_no_rollout_begins_where_the_filter_of_a_model_has_diverged(split, seen, paper, which):
    recording, begun = split.kept_back[0], []

    def resting(result, starts, commands):
        begun.append([len(start.past_commands) for start in starts])
        return np.zeros((len(starts), commands.shape[1] + 1, 7))

    last = int(np.flatnonzero(recording.usable)[0]) + 200
    given = [replace(seen), replace(seen), replace(seen)]
    given[which] = diverged(seen, last)
    kept, stretches = split.kept_back, RolloutStarts(5, 5, 4000, 3)
    gaps = measure_gaps(Models(*given), kept, resting, [3], stretches, LEVELS, paper.wheel_radius)
    assert all(np.isfinite([gap.before, gap.refitted, gap.after, gap.noise_floor]).all() for gap in gaps)
    assert 30 < len(begun[0]) <= 40 and max(begun[0]) < last
    assert rollout_error(seen, kept, resting, gaps[0], stretches) > 0.0
    assert len(begun[-1]) > 40
    assert rollout_error(diverged(seen, 0), kept, resting, gaps[0], stretches) == np.inf
    given[which] = diverged(seen, 0)
    assert measure_gaps(Models(*given), kept, resting, [3], stretches, LEVELS, paper.wheel_radius) == ()


@pytest.mark.parametrize(("rows", "is_left_out"), [(slice(1320, 1325), True), (slice(0, 1500), False)])
def test_no_rollout_begins_right_after_lost_rows_but_one_may_after_what_was_fitted(
    split, seen, paper, rows, is_left_out
):
    (recording,), begun = split.kept_back, []

    def resting(result, starts, commands):
        begun.append([len(start.past_commands) for start in starts])
        return np.zeros((len(starts), commands.shape[1] + 1, 7))

    usable = recording.usable.copy()
    usable[rows] = False
    kept, stretches = [replace(recording, usable=usable)], RolloutStarts(60, 5, 4000, 3)
    measure_gaps(Models(seen, seen, seen), kept, resting, [3], stretches, LEVELS, paper.wheel_radius)
    after = [t for each in begun for t in each if rows.stop <= t < rows.stop + 60]
    assert bool(after) is not is_left_out
    if is_left_out:
        few = stretches._replace(spacing=40)  # fewer starts than are enough would be left
        measure_gaps(Models(seen, seen, seen), kept, resting, [3], few, LEVELS, paper.wheel_radius)
        assert [t for t in begun[-1] if rows.stop <= t < rows.stop + 60]


@pytest.mark.parametrize("share", [0.0, 0.02, 1.0])
def test_rollouts_that_explode_speak_against_a_model(split, seen, paper, share):
    """Even one, which raises the mean square by no more than its standard error."""
    named = replace(seen, effects={**seen.effects, "motor_lag": {"time_constant": 0.02}})

    def resting(result, starts, commands):
        found = np.zeros((len(starts), commands.shape[1] + 1, 7))
        found[: int(np.ceil(share * len(starts)))] = np.nan if "motor_lag" in result.effects else 0.0
        return found

    gaps = measure_gaps(
        Models(seen, seen, named), split.kept_back, resting, [3], RolloutStarts(5, 5, 40, 3), LEVELS, paper.wheel_radius
    )
    assert all(np.isfinite([gap.after, gap.excess, gap.noise_floor]).all() for gap in gaps)
    assert all(gap.is_worse == (share > 0.0) for gap in gaps)


def test_a_recording_is_cut_by_the_instants_that_count(paper):
    """Such as one of a robot that first drives in circles."""
    whole = synthetic_recording(paper, {}, seed=3, periods=800, tolerance=0.0)
    usable = np.arange(801) > 600
    (first,), (last,) = held_out([replace(whole, usable=usable)], 0.25)[:2]
    assert (first.usable.sum(), last.usable.sum()) == (150, 51)
    assert [whole.instants_until(each) for each in (0.75, 0.001, 1.0)] == [600, 1, 800]
    shortened = Data([replace(whole, usable=usable)], SUBSTEPS).shortened(50)
    assert shortened.count == 50


def run(robot, result, starts, commands):
    return replay(robot, effects_from(result.effects), 0.001, starts, commands)


def test_rollouts_begin_at_the_motion_that_was_measured(split, seen):
    """The model's angles run ahead of its rates by half a step; the wheel turns by more in it than its encoder errs."""
    recording, path = split.kept_back[0], seen.trajectories[0]
    off = path.wheel_angle - recording.measured[:, MEASURED.index("wheel_angle")]
    assert np.abs(np.polyfit(recording.measured[:, 3], off, 1)[0]) < 0.1 * recording.period / SUBSTEPS


@pytest.mark.parametrize("count", [4, 5, 7, 9, 20])
@pytest.mark.parametrize("share", [0.01, 0.1, 0.15, 0.2, 0.25, 0.5, 0.9])
def test_of_several_recordings_some_are_kept_back_and_some_fitted(count, share):
    recordings = [SimpleNamespace(name=str(number)) for number in range(count)]
    split = held_out(recordings, share)
    assert split.kept_back and split.fitted and not split.are_ends
    assert len(split.kept_back) + len(split.fitted) == count
    assert split.names == tuple(recording.name for recording in split.kept_back)
