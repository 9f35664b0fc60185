"""What rollouts tell of a robot's parameters, as a simulation, a table and a file."""

from dataclasses import replace

import numpy as np
import pytest
from falling import falls_at_once

from twbal.algorithm.distribution_file import KIND, from_payload, load_distribution, save_distribution, to_payload
from twbal.algorithm.identification import Identification, identify
from twbal.core.errors import CheckpointError, ConfigError
from twbal.io.checkpoint import save_checkpoint
from twbal.planar.parameters import planar_parameters
from twbal.planar.robot_distribution import prior_of

NUMBERS = ("mean", "covariance", "low", "high", "sensor_sd", "torque_sd", "filter_rate")


def drawn(robot):
    """A distribution about another mean, in which all parameters depend on each other."""
    prior = prior_of(robot)
    root = np.diag(np.sqrt(prior.covariance.diagonal())) @ (np.eye(len(prior.mean)) + 0.1 * np.tri(len(prior.mean)))
    mean = np.clip(prior.mean + 0.3 * np.sqrt(prior.covariance.diagonal()), prior.low, prior.high)
    return replace(prior, mean=mean, covariance=root @ root.T)


def test_the_simulation_is_the_robot_of_the_mean(paper):
    known = drawn(paper)
    effects = Identification(prior_of(paper), known, {}).effects
    assert set(effects) == {field.rsplit("_", 1)[0] for field in known.fields}
    planar = planar_parameters(paper, effects)
    assert [getattr(planar, field) for field in known.fields] == known.mean.tolist()


def test_rollouts_that_tell_nothing_leave_the_prior_and_say_so(paper):
    lines = []
    found = identify(paper, {}, [falls_at_once(paper, 3), falls_at_once(paper, 2)], lines.append)
    for name in NUMBERS:
        np.testing.assert_array_equal(getattr(found.known, name), getattr(prior_of(paper), name))
    said = "None of 2 episodes has 5 control periods of a robot that stands."
    assert found.why_uninformative == said
    assert lines == [f"nothing was estimated, all values are those of the sheet: {said}"]


def test_what_the_simulation_was_given_is_where_the_estimate_begins_and_stays_where_nothing_is_told(paper):
    given = {"torque_gain": {"gain": 0.6}, "ground_slope": {"angle": 0.02}, "tilt_filter": {"rate": 0.4, "lead": 0.01}}
    given |= {"sensor_noise": dict.fromkeys(("tilt", "tilt_rate", "wheel_rate"), 0.01)}
    untold = identify(paper, given, [falls_at_once(paper, 3)], lambda line: None)
    assert {name: untold.effects[name] for name in given} == given
    told = identify(paper, given, [falls_at_once(paper, 12)], lambda line: None)
    assert {name: told.effects[name] for name in ("tilt_filter", "sensor_noise")} == {
        name: given[name] for name in ("tilt_filter", "sensor_noise")
    }
    assert told.effects["ground_slope"]["angle"] == pytest.approx(0.02, abs=0.006)  # three standard deviations
    assert "ground_slope.angle" in "\n".join(told.table())


def test_one_rollout_that_tells_something_is_enough(paper):
    lines = []
    found = identify(paper, {}, [falls_at_once(paper, 3), falls_at_once(paper, 12)], lines.append)
    assert not found.why_uninformative
    assert not np.array_equal(found.known.mean, found.prior.mean)
    (line,) = lines
    assert line.startswith("estimated from the rollouts: torque_gain_gain ")


def test_the_table_has_parameters_with_units_before_and_after(paper):
    known = drawn(paper)
    head, *rows = Identification(prior_of(paper), known, {}).table()
    assert head.split("  ")[0] == "parameter"
    assert len(rows) == len(known.fields) + 1  # the filter of the tilt
    (row,) = (row for row in rows if row.startswith("dead_zone.width"))
    before, sd = prior_of(paper).mean[1], np.sqrt(prior_of(paper).covariance[1, 1])
    assert row.split()[1:5] == ["N·m", f"{before:.4g}", "±", f"{sd:.2g}"]
    assert row.split()[5] == f"{known.mean[1]:.4g}"
    of_each_wheel = {row.split()[0] for row in rows if " a wheel " in row}
    assert of_each_wheel == {"coulomb_friction.torque", "viscous_friction.coefficient"}


def test_a_distribution_comes_back_from_its_file_bit_for_bit(paper, tmp_path):
    known = drawn(paper)
    first, second = (save_distribution(tmp_path / name, known) for name in ("a.pt", "b.pt"))
    assert first == second
    found = load_distribution(tmp_path / "a.pt", paper)
    assert (found.fields, found.robot) == (known.fields, paper)
    for name in NUMBERS:
        np.testing.assert_array_equal(getattr(found, name), getattr(known, name))


def test_another_robot_is_refused(paper, tmp_path):
    save_distribution(tmp_path / "a.pt", drawn(paper))
    heavier = replace(paper, body_mass=paper.body_mass + 1.0)
    with pytest.raises(ConfigError, match=r"other nominal parameters .* Run `twbal identify` with this robot"):
        load_distribution(tmp_path / "a.pt", heavier)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("mean", np.full(10, 1e5), "mean must lie within its bounds"),
        ("mean", np.zeros(8), r"mean must be numbers of shape \(10\)"),
        ("covariance", -np.eye(10), "covariance must be symmetric and positive definite"),
        ("covariance", np.tri(10), "covariance must be symmetric and positive definite"),
        ("covariance", np.ones((10, 10)), "covariance must be symmetric and positive definite"),
        ("sensor_sd", np.full(4, -1.0), r"sensor_sd must be within \[0"),
        ("fields", ["body_mass"] * 10, "different parameters of the planar model"),
    ],
)
def test_what_is_no_distribution_is_refused(paper, tmp_path, name, value, said):
    save_checkpoint(tmp_path / "a.pt", KIND, {**to_payload(drawn(paper)), name: value})
    with pytest.raises(CheckpointError, match=said):
        load_distribution(tmp_path / "a.pt", paper)


def test_an_entry_that_is_missing_is_named(paper):
    payload = to_payload(drawn(paper))
    del payload["low"]
    with pytest.raises(CheckpointError, match="has no 'low'"):
        from_payload(payload, paper)


def test_the_table_says_how_far_a_parameter_moved(paper):
    prior, known = prior_of(paper), drawn(paper)
    _, *rows = Identification(prior, known, {}).table()
    (row,) = (row for row in rows if row.startswith("dead_zone.width"))
    moved = (known.mean[1] - prior.mean[1]) / np.sqrt(prior.covariance[1, 1])
    assert float(row.split()[-1]) == pytest.approx(moved, abs=0.05)


def test_a_parameter_at_a_bound_of_its_range_is_no_estimate_but_none_is_one_of_nothing(paper):
    """A COM height at its least value is said to be; a dead zone of 0 is one that there may well be."""
    prior = prior_of(paper)
    mean = prior.mean.copy()
    mean[prior.fields.index("com_height_factor")] = 0.4
    mean[prior.fields.index("dead_zone_width")] = 0.0
    told = Identification(prior, replace(prior, mean=mean), {})
    assert told.at_bound == ("com_height.factor",)
    (row,) = (row for row in told.table() if row.startswith("com_height.factor"))
    assert row.endswith("at its bound")


@pytest.mark.parametrize(("gain", "told"), [(0.2000355, ("torque_gain.gain",)), (0.21, ())])
def test_an_estimate_that_stopped_a_little_before_a_bound_is_told_as_one_at_it(paper, gain, told):
    prior = prior_of(paper)
    mean = prior.mean.copy()
    mean[prior.fields.index("torque_gain_gain")] = gain  # its range begins at 0.2
    assert Identification(prior, replace(prior, mean=mean), {}).at_bound == told


def test_an_estimate_far_from_what_was_known_is_told(paper):
    prior = prior_of(paper)
    moved = np.zeros(len(prior.mean))
    moved[prior.fields.index("com_height_factor")] = -5.0
    moved[prior.fields.index("torque_gain_gain")] = 2.0
    mean = prior.mean + moved * np.sqrt(prior.covariance.diagonal())
    assert Identification(prior, replace(prior, mean=mean), {}).far_off == ("com_height.factor",)
    filtered = replace(prior, filter_rate=(prior.filter_rate[0] + 8.0 * prior.filter_rate[1], 0.01))
    assert Identification(prior, filtered, {}).far_off == ("1 / time constant of the tilt's filter",)
    assert Identification(prior, prior, {}).far_off == ()
