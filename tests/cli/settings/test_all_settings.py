"""All settings of all stages and choices: what is packaged is right, and what cannot be right is refused."""

import math
from fnmatch import fnmatch

import pytest
from packaged_configurations import all_composed

from twbal.cli.settings.lookup import GROUPS, STAGES, Table, leaves, stage_settings
from twbal.cli.settings.validate import faults

MAY_BE_NEGATIVE = (
    "robot.com_offset",
    "start.tilt_mean",
    "faults.com_offset",
    "faults.*_difference",
    "faults.dead_zone_skew",
    "faults.slope",
    "faults.mounting_angle",
    "faults.gyro_bias",
    "*.angle",
    "*.phase",
    "*.gyro_bias.rate",
    "*.cable_spring.anchor_*",
    "*.cogging.difference",
    "*.cogging.turning",
    "*.dead_zone.skew",
    "*.tilt_filter.lead",
    "*.unequal_motors.share",
    "model.*.log_mean",
)
NOT_ZERO = (
    *("robot.body_*", "robot.com_height", "robot.wheel_*", "robot.track", "robot.torque_limit", "robot.control_period"),
    *(
        "*physics_step",
        "*tilt_limit",
        "steps",
        "*.steps",
        "rollouts",
        "*.rollouts",
        "calibration_steps",
        "random_rollouts",
    ),
    *(
        "sim_round_rollouts",
        "success.tilt_limit",
        "success.settled_tilt_limit",
        "policy.amplitude",
        "policy.hold",
        "policy.command_width",
        "oscillation_limit",
    ),
    *(
        "state.wheel_radius",
        "cost.widths.*",
        "cost.torque_limit",
        "parametrisation.basis",
        "parametrisation.scale.*",
        "search.horizon",
    ),
    *(
        "search.short_horizon",
        "search.long_horizon",
        "search.iterations",
        "search.tolerance",
        "validation.*",
        "agent.scales.*",
    ),
    *("model.*.starts", "model.*.finalists", "model.*.iterations", "model.*.inducing", "model.*.screening_points"),
    *(
        "model.smoothing.*",
        "diagnosis.tolerances.data_sheet",
        "diagnosis.tolerances.*_timing",
        "diagnosis.*temperature",
    ),
    *("diagnosis.substeps", "diagnosis.shortlist", "diagnosis.max_effects", "diagnosis.blocks", "held_out", "starts"),
    *("bins", "min_length", "min_samples", "max_yaw_rate", "max_tilt", "link.*timeout", "link.baud_rate", "watchdog"),
    *("idle_timeout", "faults.outer", "faults.reference_torque", "import.motor.*", "*.factor", "*.gain", "resync"),
    *("seconds", "frame_rate", "width", "height", "command_width", "agent.options.learning_rate"),
)
NOT_EMPTY = (
    "state.names",
    "search.linearisation_amplitudes",
    "search.lqr_command_widths",
    "search.gain_scales",
    "horizons",
    "policy.widths",
)
MORE_THAN_IS_PACKAGED = (  # rows that only a user's own yaml or words have
    *("runs.*", "sims.*"),
    *("*.yaw_rate", "*.noise_prior.*", "import.quantities.*", "sim.effects.*", "sim.draws.*", "ensemble.*"),
    *("sim.draws", "sim.effects", "agent.options", "model.fit_f.settings.length_scale_prior.*"),
    *(
        "model.fit_f.settings.fit.length_scale_prior.*",
        "link.confirm_placed",
        "import.motor",
        "policy.robot",
        "course.robot",
        "steering.robot",
        "validation.success",
    ),
)


def known_leaves(composed):
    """Leaves by key, but for those of parts that stand for another."""
    for leaf in leaves(composed.tree):
        if not any(f"{leaf.key}.".startswith(f"{key}.") for key in composed.references):
            yield leaf


def changed(tree, change, prefix=""):
    """A configuration in which every value is changed."""
    return {
        name: changed(value, change, f"{prefix}{name}.")
        if isinstance(value, dict) and value
        else value
        if name in ("_target_", "_partial_", "_convert_")
        else change(f"{prefix}{name}", value)
        for name, value in tree.items()
    }


MAY_BE_NULL = ("yield_to_pushes", "*.yield_to_pushes")  # although they are false in some stages and experiments


def among(key, patterns):
    return any(fnmatch(key, pattern) for pattern in patterns)


def is_number(value):
    return isinstance(value, int | float) and not isinstance(value, bool)


def all_refused(composed, change, applies=lambda key, value: True):
    """Change all values at once to what cannot be; each must be named."""
    wrong = changed(composed.tree, lambda key, value: change(value) if applies(key, value) else value)
    refused = {fault.key for fault in faults(composed.stage, wrong)}
    expected = {leaf.key for leaf in known_leaves(composed) if applies(leaf.key, leaf.value)}
    accepted = expected - refused
    assert not accepted, (composed.stage, composed.words)


@pytest.mark.slow
def test_what_is_packaged_is_accepted():
    for composed in all_composed():
        assert list(faults(composed.stage, composed.tree)) == [], composed.words


def test_every_packaged_setting_is_in_the_table():
    for composed in all_composed():
        table = Table(composed.stage, composed.tree)
        unknown = [leaf.key for leaf in known_leaves(composed) if table.row(leaf.key) is None]
        assert not unknown, (composed.stage, composed.words)


def test_every_row_of_the_table_is_of_a_packaged_setting():
    found = set()
    for composed in all_composed():
        table = Table(composed.stage, composed.tree)
        found |= {(composed.stage, row.key) for leaf in leaves(composed.tree) if (row := table.row(leaf.key))}
    keys = {key for _, key in found}
    unused = [row.key for rows in GROUPS.values() for row in rows if row.key not in keys]
    unused += [row.key for stage, rows in STAGES.items() for row in rows if (stage, row.key) not in found]
    assert [key for key in unused if not among(key, MORE_THAN_IS_PACKAGED)] == []


def test_no_setting_has_two_rows():
    for stage in STAGES:
        keys = [row.key for row in stage_settings(stage)]
        assert len(keys) == len(set(keys))


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300, -1e300, [[]]], ids=repr)
def test_no_setting_takes(value):
    for composed in all_composed():
        all_refused(composed, lambda _, value=value: value)


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e300, -1e300], ids=repr)
def test_no_list_takes_a_member_that_is(value):
    for composed in all_composed():
        all_refused(composed, lambda now: [*now[:-1], value], lambda _, now: isinstance(now, list) and len(now) > 0)


@pytest.mark.parametrize("value", ["abc", "", [1.0], ["abc"], None, True], ids=repr)
def test_no_number_may_be(value):
    may_be_null = (
        "cost.command_width",
        "cost.command_change_width",
        "oscillation_limit",
        "success.place_radii",
        "success.command_change",
        "success.heading_limit",
        "exploration_steps",
        "*.exploration_steps",
        "import.quantities.*",
    )
    texts = () if value is None else ("import.quantities.*.from",)
    for composed in all_composed():
        all_refused(
            composed,
            lambda _: value,
            lambda key, now: is_number(now) and not among(key, (*texts, *may_be_null)),
        )


def test_no_number_may_be_negative_but_for_those_with_a_sign():
    for composed in all_composed():
        all_refused(composed, lambda _: -0.5, lambda key, now: is_number(now) and not among(key, MAY_BE_NEGATIVE))
        all_refused(composed, lambda _: -1, lambda key, now: is_number(now) and not among(key, MAY_BE_NEGATIVE))


def test_no_number_may_be_zero_where_nothing_is_left_of_it():
    for composed in all_composed():
        all_refused(composed, lambda _: 0, lambda key, now: is_number(now) and among(key, NOT_ZERO))


def test_no_list_may_be_empty_where_something_is_needed():
    for composed in all_composed():
        all_refused(composed, lambda _: [], lambda key, now: among(key, NOT_EMPTY))


def test_no_count_may_be_broken():
    for composed in all_composed():
        all_refused(composed, lambda now: now + 0.5, lambda _, now: isinstance(now, int) and not isinstance(now, bool))


@pytest.mark.parametrize("value", [0, 1, "yes", "true", None], ids=repr)
def test_yes_and_no_are_true_and_false_alone(value):
    for composed in all_composed():
        all_refused(
            composed,
            lambda _: value,
            lambda key, now: isinstance(now, bool) and not (value is None and among(key, MAY_BE_NULL)),
        )


def test_the_table_says_a_meaning_and_a_range_of_everything():
    for composed in all_composed():
        table = Table(composed.stage, composed.tree)
        for leaf in known_leaves(composed):
            row = table.row(leaf.key)
            assert row.meaning, leaf.key
            assert row.kind.range, leaf.key
            assert row.kind.expected, leaf.key
