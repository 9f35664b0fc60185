"""Robots that change: how far they are from what is known, and that a search for margin holds more of them."""

from dataclasses import replace

import numpy as np
import pytest
from sampled import known_to_be, sampled_robots

from twbal.core.streams import Stream, generator
from twbal.planar.robot_distribution import prior_of
from twbal.search.margin import Margin

CHANGE = Margin(doubt=0.5, delay=1.0, noise=2.0, push=1.0, push_duration=0.1)


def models(known, margin, count=4000):
    return margin.models(known, count, generator(Stream.SAMPLED_ROBOTS, 3), 1.0)


def test_changed_robots_are_as_doubtful_as_what_is_known_and_a_share_of_the_sheet_together(paper):
    known = known_to_be(paper, spread=0.2)
    drawn = np.array([model.body_mass_factor for model in models(known, CHANGE)])
    sheet = np.sqrt(prior_of(paper).covariance[known.fields.index("body_mass_factor")].max())
    assert drawn.std() == pytest.approx(np.hypot(0.2, 0.5) * sheet, rel=0.05)
    assert drawn.mean() == pytest.approx(1.0, abs=0.01)


def test_a_number_that_the_sheet_does_not_tell_changes_no_more_than_it_is_doubtful(paper):
    known = prior_of(paper, {"ground_slope": {"angle": 0.02}})
    drawn = np.array([model.ground_slope_angle for model in models(known, CHANGE)])
    assert drawn.std() == pytest.approx(0.002, rel=0.05)


def test_their_commands_are_later_by_up_to_so_many_control_periods(paper):
    known = known_to_be(paper, spread=0.0, actuation_delay_delay=0.01)
    late = np.array([model.actuation_delay_delay for model in models(known, replace(CHANGE, doubt=0.0, delay=1.5))])
    assert late.min() == pytest.approx(0.01, abs=1e-4)
    assert late.max() == pytest.approx(0.01 + 1.5 * paper.control_period, abs=1e-4)
    assert late.mean() == pytest.approx(0.01 + 0.75 * paper.control_period, rel=0.03)


def test_every_other_robot_is_pushed_with_the_impulse_that_is_asked(paper):
    """By the momentum: what the axle gains where the body is free to tilt back."""
    robots = sampled_robots(paper, known_to_be(paper), with_margin=True)
    still, pushed = robots._drawn(robots.rule.steps), robots._changed_draws
    by = pushed.jolts - still.jolts
    steps = round(0.1 / paper.control_period)
    assert not by[::2].any() and not by[:, steps:].any()
    assert (np.sign(by[1::4, 0, 1]) == 1.0).all() and (np.sign(by[3::4, 0, 1]) == -1.0).all()
    assert (pushed.start[1::2, 1:] == 0.0).all() and (pushed.start[::2] == still.start[::2]).all()
    np.testing.assert_array_equal(pushed.sensors, 2.0 * still.sensors)
    mass, wheel = paper.body_mass, paper.wheel_mass + paper.wheel_inertia / paper.wheel_radius**2
    axle = paper.wheel_radius * by[1, :steps, 1].sum()  # what the axle gains where nothing else acts [m/s]
    l, c = paper.com_height, paper.body_inertia_pitch + paper.body_mass * paper.com_height**2
    effective = mass + 2.0 * wheel - (mass * l) ** 2 / c  # the axle's, as the body tilts back about its centre
    assert axle == pytest.approx(1.0 * mass / effective, rel=0.15)


@pytest.fixture(scope="module")
def stiff(paper):
    """Robots that are known, whose regulators are searched without and with margin."""
    told = {"improved": 1, "evaluations": 120, "improving": 15}
    robots = sampled_robots(paper, known_to_be(paper, actuation_delay_delay=0.01), **told)
    with_margin = replace(robots, with_margin=True)
    return with_margin, robots.regulators()[0].policy, with_margin.regulators()[0]


@pytest.mark.slow
def test_a_search_for_margin_holds_more_of_the_robots_that_changed(stiff):
    robots, without, found = stiff
    assert found.margin == robots.changed(found.policy).success
    assert found.margin > robots.changed(without).success
    assert robots.driven(found.policy).success > 0.9


@pytest.mark.slow
def test_where_margin_is_asked_it_counts_as_much_as_success_with_the_robots_as_they_are(stiff):
    robots, without, found = stiff
    plain = robots.ranked("without", without)
    as_known, changed = robots.driven(without), robots.changed(without)
    assert plain.use == 0.5 * (as_known.mean_use + changed.mean_use)
    assert plain.rank == (plain.use - 0.5 * (plain.success + changed.success), 0.0)
    assert found.rank <= plain.rank
    assert replace(robots, with_margin=False).ranked("without", without).margin is None
