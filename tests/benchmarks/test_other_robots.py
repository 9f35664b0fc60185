"""The robots of the other benchmark of the diagnosis move as mechanics says, and share nothing with what it tests."""

import ast
from dataclasses import replace
from math import cosh, exp
from pathlib import Path

import numpy as np
import pytest
from hydra import compose
from hydra.utils import instantiate

from benchmarks.hidden_effects.robot import STEP as MUJOCO_STEP
from benchmarks.hidden_effects.robot import Ride, drawn
from benchmarks.other_robots.drive import STEP, advance, drive, motor
from benchmarks.other_robots.kinds import ALL, FOREIGN, KNOWN_SINCE, SHAPES, STRUCTURAL, drawn_values, put
from benchmarks.other_robots.mechanics import (
    GRAVITY,
    HEADING,
    PITCH,
    ROTOR_L,
    ROTOR_RATE_L,
    SIZE,
    SPIN_L,
    SPIN_R,
    TORQUE_L,
    Q,
    V,
    W,
    X,
    bristles,
    energy,
)
from benchmarks.other_robots.power import detection_power, said_at
from benchmarks.other_robots.recording import driven, record
from benchmarks.other_robots.robots import ITEMS, cascade, drawn_sensors, nominal, regulator
from benchmarks.other_robots.score import judged
from benchmarks.other_robots.sets import EXCITATIONS, ONE_SENSOR, RATES, SENSORS, SHEETS, STRATA, designed, sets
from benchmarks.other_robots.tables import other_robots_lost
from twbal.cli.composition import composing
from twbal.effects.library import library
from twbal.effects.parameter import parameters_of
from twbal.io.logs import read_episode
from twbal.planar.equations import coefficients

ROOT = Path(__file__).parents[2] / "benchmarks" / "other_robots"
FORBIDDEN = ("twbal.sim", "twbal.planar", "twbal.effects", "twbal.sysid", "twbal.diagnosis", "twbal.virtual_robot")


@pytest.mark.parametrize("file", sorted(path.name for path in ROOT.glob("*.py")))
def test_the_robots_share_no_code_with_simulation_planar_model_or_diagnosis(file):
    for node in ast.walk(ast.parse((ROOT / file).read_text())):
        names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
        names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        assert not any(name.startswith((*FORBIDDEN, "benchmarks.hidden")) for name in names)


@pytest.fixture(scope="module")
def sheets():
    with composing():
        return {name: instantiate(compose("sim_collect", [f"robot={name}"]).robot) for name in SHEETS}


@pytest.fixture(scope="module")
def paper(sheets):
    return sheets["paper"]


def moved(machine, y, seconds, torques=(0.0, 0.0)):
    """The state after some time under constant torques."""
    bent, work = np.zeros(4), np.zeros((5, SIZE))
    for i in range(round(seconds / STEP)):
        advance(y, i * STEP, *torques, bent, machine, work)
    return y


def state(machine, tilt=0.0, tilt_rate=0.0, speed=0.0, yaw_rate=0.0):
    y = np.zeros(SIZE)
    y[PITCH], y[Q], y[V], y[W] = tilt, tilt_rate, speed, yaw_rate
    y[SPIN_L] = (speed - machine.half_track * yaw_rate) / machine.radius
    y[SPIN_R] = (speed + machine.half_track * yaw_rate) / machine.radius
    return y


@pytest.mark.slow
@pytest.mark.parametrize("name", SHEETS)
@pytest.mark.parametrize("change", [{}, {"slope": 0.1}, {"rotor_share": 0.6, "geared": 1.0}, {"offset": 0.1}])
def test_without_friction_a_turning_robot_keeps_its_energy(name, change, sheets):
    machine = nominal(sheets[name])._replace(**change)
    y = state(machine, 0.1, 0.5, 0.4, 2.0)
    before = energy(y, machine)
    moved(machine, y, 0.5)
    assert abs(y[PITCH] - 0.1) > 0.05
    moving = machine.mass * GRAVITY * machine.height
    assert energy(y, machine) == pytest.approx(before, abs=1e-7 * moving)


@pytest.mark.slow
@pytest.mark.parametrize("name", SHEETS)
def test_it_falls_as_the_equations_of_another_derivation_say(name, sheets):
    k = coefficients(sheets[name])
    pole = np.sqrt(k.a * k.d / (k.a * k.c - k.b**2))
    y = moved(nominal(sheets[name]), state(nominal(sheets[name]), 1e-5), 0.3)
    assert y[PITCH] == pytest.approx(1e-5 * cosh(pole * 0.3), rel=1e-6)


@pytest.mark.slow
def test_it_moves_as_a_robot_of_another_engine_does(paper):
    ride, machine = Ride(drawn(paper, np.random.default_rng(0), 0.0, 0.0)), nominal(paper)
    ride.place(0.1, 0.2, 0.3)
    y = state(machine, 0.1, 0.2, 0.3)
    for _ in range(round(0.3 / MUJOCO_STEP)):
        ride.step(np.array([0.9, 1.3]), 0.0, np.zeros(2), 0.0)
    moved(machine, y, 0.3, (0.9, 1.3))
    assert [y[PITCH], y[Q], y[V], y[W]] == pytest.approx(
        [ride.tilt(), ride.tilt_rate(), ride.speed(), ride.yaw_rate()], rel=0.03
    )


@pytest.mark.slow
def test_play_that_is_never_crossed_is_a_stiff_gear(paper):
    """Both flanks touch where a gap is nearly nothing."""
    machine = nominal(paper)
    rigid = moved(machine, state(machine, 0.02), 0.2, (0.5, 0.5))
    loose = moved(machine._replace(gap=1e-6, rotor_share=0.5), state(machine, 0.02), 0.2, (0.5, 0.5))
    assert loose[[PITCH, V]] == pytest.approx(rigid[[PITCH, V]], rel=0.02)


@pytest.mark.slow
def test_a_rotor_turns_freely_within_its_play_and_then_takes_its_wheel_along(paper):
    machine = nominal(paper)._replace(gap=0.2, rotor_share=0.5)
    y = moved(machine, state(machine), 0.05, (0.1, 0.1))
    inertia = 0.5 * machine.wheel_inertia
    assert y[ROTOR_L] + y[PITCH] == pytest.approx(0.5 * 0.1 / inertia * 0.05**2, rel=1e-3)  # in space
    assert y[X] == pytest.approx(0.0, abs=2e-4)
    moved(machine, y, 0.3, (0.1, 0.1))
    assert y[ROTOR_L] - y[5] == pytest.approx(0.1, abs=0.01)
    assert y[X] > 0.001 and y[ROTOR_RATE_L] == pytest.approx(y[SPIN_L] - y[Q], rel=0.1)


@pytest.mark.slow
def test_lugre_settles_at_its_kinetic_torque_and_holds_what_is_less():
    bent, torque = bristles(0.0, 5.0, 1.0, 0.2, 0.5, 0.5, 0.003)
    assert torque == pytest.approx(0.2, rel=1e-6)
    bent, torque = bristles(0.0, 0.001, 100.0, 0.2, 0.5, 0.5, 0.003)
    assert torque == pytest.approx(0.5, rel=0.02)
    _, back = bristles(bent, -5.0, 1.0, 0.2, 0.5, 0.5, 0.003)
    assert back == pytest.approx(-0.2, rel=1e-6)


@pytest.mark.slow
def test_dry_friction_brakes_a_robot_that_is_held_upright_as_its_torque_says(paper):
    """Against a robot that gets the same torque from its motors: the joints cannot tell."""
    machine = nominal(paper)
    braked = moved(machine._replace(kinetic=0.3, static=0.3), state(machine, speed=0.5), 0.1)
    driven_back = moved(machine, state(machine, speed=0.5), 0.1, (-0.3, -0.3))
    assert braked[[V, Q]] == pytest.approx(driven_back[[V, Q]], rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize(("asked", "given"), [(0.4, 0.0), (0.8, 0.3), (-0.8, -0.3), (-1.5, -1.0)])
def test_a_dead_zone_takes_its_half_width_of_both_motors_together(asked, given, paper):
    machine = nominal(paper)._replace(dead_zone=1.0)
    assert motor(asked, 0.0, 0, 0.0, machine) == pytest.approx(given, abs=1e-3)


@pytest.mark.slow
def test_limit_gain_and_battery_act_on_the_torque_as_said(paper):
    machine = nominal(paper)
    assert motor(9.0, 0.0, 0, 0.0, machine._replace(limit=4.0)) == pytest.approx(2.0, rel=1e-3)
    assert motor(1.0, 0.0, 0, 0.0, machine._replace(limit=4.0)) == 1.0
    assert motor(1.0, 0.0, 0, 0.0, machine._replace(gain=0.8, uneven=0.02)) == pytest.approx(0.8 * 0.98)
    assert motor(1.0, 0.0, 0, 10.0, machine._replace(sag=0.05)) == pytest.approx(1.0 / 1.5)


@pytest.mark.slow
def test_a_lag_answers_as_a_first_order_system(paper):
    machine = nominal(paper)._replace(lag=0.02)
    y = moved(machine, state(machine), 0.03, (1.0, 1.0))
    assert y[TORQUE_L] == pytest.approx(1.0 - exp(-1.5), rel=1e-6)


@pytest.mark.slow
def test_a_slew_limit_holds_the_rate_of_the_torque(paper):
    y = moved(nominal(paper)._replace(slew=4.0), state(nominal(paper)), 0.1, (1.0, 1.0))
    assert y[TORQUE_L] == pytest.approx(0.2, rel=0.01)


@pytest.mark.slow
def test_tyres_that_slip_pull_no_more_than_their_grip(paper):
    machine = nominal(paper)._replace(grip=0.1)
    y = moved(machine, state(machine), 0.1, (8.0, 8.0))
    # Momentum along the ground is what the tyres gave, at most grip · weight · time.
    momentum = (machine.mass + 2 * machine.wheel_mass) * y[V] + machine.mass * machine.height * np.cos(y[PITCH]) * y[Q]
    assert momentum == pytest.approx(0.1 * machine.load * 0.1, rel=0.1)
    assert machine.radius * y[SPIN_L] > 2.0 * y[V]


@pytest.mark.slow
def test_tyres_with_enough_grip_roll(paper):
    machine = nominal(paper)
    rolled = moved(machine, state(machine, 0.05), 0.2, (0.5, 0.5))
    slipped = moved(machine._replace(grip=0.4), state(machine, 0.05), 0.2, (0.5, 0.5))
    assert slipped[[PITCH, V]] == pytest.approx(rolled[[PITCH, V]], rel=0.02, abs=1e-3)


@pytest.mark.slow
def test_a_cable_pulls_towards_its_place_wherever_the_robot_heads(paper):
    machine = nominal(paper)._replace(cable=10.0, cable_x=0.4)
    forth, back, across = (state(machine) for _ in range(3))
    back[HEADING], across[HEADING] = np.pi, np.pi / 2
    forth, back, across = (moved(machine, y, 0.02)[V] for y in (forth, back, across))
    assert forth == pytest.approx(-back, rel=1e-6) and forth > 0
    assert across == pytest.approx(0.0, abs=1e-6 * forth)


def shown(sheet, machine, sensors, seconds=2.0, law=None, noise=None, speed=0.0):
    periods = round(seconds / sheet.control_period)
    instants = np.arange(periods + 1) * round(sheet.control_period / STEP)
    noise = np.zeros((periods + 1, 6)) if noise is None else noise
    still, asked = np.zeros(periods + 1), np.zeros((periods + 1, 3))
    asked[periods // 4 :, 0] = speed
    law = law or regulator(sheet, 1.0)
    start = state(machine, 0.03)
    return drive(start, machine, sensors, law, instants, asked, noise, still, still > 0, 0.6)


@pytest.mark.slow
def test_commands_act_late_by_the_delay_to_the_fraction_of_a_period(paper):
    machine, sensors = nominal(paper), drawn_sensors("ideal", paper, np.random.default_rng(0))
    prompt, late = (shown(paper, machine._replace(delay=d), sensors, 0.02)[1] for d in (0.0, 0.007))
    unforced = moved(machine, state(machine, 0.03), 0.02)
    gained, later = prompt[1, 2] - unforced[Q], late[1, 2] - unforced[Q]
    assert later / gained == pytest.approx(13.0 / 20.0, rel=0.02)


@pytest.mark.slow
def test_sensors_show_what_is_said_of_them(paper):
    machine = nominal(paper)
    plain = drawn_sensors("ideal", paper, np.random.default_rng(0))._replace(tilt=0.0, gyro=0.0, ticks=1e9)
    law = regulator(paper, 1.0)._replace(tilt=0.0, rate=0.0, speed=0.0, turn=0.0)
    askew = plain._replace(gyro_bias=0.1, gyro_scale=1.2, mount=0.05)
    true, seen = (shown(paper, machine, s, 0.2, law) for s in (plain, askew))
    assert seen[1][:, 1] == pytest.approx(true[3][:, 0] + 0.05)
    assert seen[1][:, 2] == pytest.approx(1.2 * true[3][:, 1] + 0.1)
    late = shown(paper, machine, plain._replace(delay=0.02), 0.2, law)
    assert late[1][1:, 1] == pytest.approx(true[3][:-1, 0], abs=1e-12)
    assert true[1][:, 4] == pytest.approx(true[3][:, 3], abs=1e-6)


@pytest.mark.slow
def test_coarse_encoders_count_ticks_and_their_rates_are_differences(paper):
    rng = np.random.default_rng(1)
    sensors = drawn_sensors("real", paper, rng)._replace(ticks=300.0)
    _, seen, *_ = shown(paper, nominal(paper), sensors, 2.0, None, rng.standard_normal((101, 6)))
    halves = seen[:, 4] / (np.pi / 300.0)
    assert halves == pytest.approx(np.round(halves), abs=1e-9)
    assert seen[1:, 5] == pytest.approx(np.diff(seen[:, 4]) / 0.02)


@pytest.mark.slow
def test_a_complementary_filter_trusts_the_accelerometer_slowly(paper):
    """A robot that leans at rest upon its cable would be misread for a time constant after a slip of the gyro."""
    machine = nominal(paper)
    sensors = drawn_sensors("real", paper, np.random.default_rng(0))._replace(
        tilt=0.0, gyro=0.0, tilt_constant=0.5, gyro_bias=0.02
    )
    count, seen, _, true, _ = shown(paper, machine, sensors, 8.0)
    assert count == 400
    error = (seen[:, 1] - true[:, 0])[200:]
    assert error.mean() == pytest.approx(0.5 * 0.02, rel=0.2)  # bias times time constant


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(ALL))
@pytest.mark.parametrize("law", [regulator, cascade])
def test_each_effect_changes_what_the_robot_shows(name, law, sheets):
    if name in ("command_loss", "gyro_bias_walk"):  # arrays of the rollout: below
        return
    sheet = sheets["regbot"]
    rng = np.random.default_rng(3)
    machine, sensors = nominal(sheet), drawn_sensors("ideal", sheet, rng)
    values = drawn_values(name, 1.0, sheet, rng)
    if ALL[name].met:
        values |= {"torque_saturation": {"limit": 0.02}, "wheel_slip": {"friction": 0.02}}.get(name, {"rate": 0.5})
    seconds = 8.0 if name in SHAPES else 2.0  # some begin after a while, or some way on
    noise = np.random.default_rng(4).standard_normal((round(seconds / sheet.control_period) + 1, 6))
    before = shown(sheet, machine, sensors, seconds, law(sheet, 1.0), noise, speed=0.3)[1]
    after = shown(sheet, *put(name, values, machine, sensors), seconds, law(sheet, 1.0), noise, speed=0.3)[1]
    rows = min(len(before), len(after))
    assert np.abs(before[:rows, 1] - after[:rows, 1]).max() > 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("name", ["command_loss", "gyro_bias_walk"])
def test_what_acts_in_the_loop_changes_what_the_robot_shows(name, sheets):
    seed = next(s for s in range(100) if name in designed("foreign", s).effects)
    each = designed("foreign", seed)
    sheet = replace(sheets[each.sheet], control_period=1.0 / each.rate)
    with_it, without = driven(each, sheet), driven(each._replace(effects={}), sheet)
    assert not np.array_equal(with_it.rollouts[0].seen, without.rollouts[0].seen)


def test_hidden_values_are_named_as_in_the_library(paper):
    kinds = library()
    for name, kind in ALL.items():
        if name not in KNOWN_SINCE and (name in FOREIGN or name in SHAPES):
            assert name not in kinds
        else:
            parameters = parameters_of(kinds[name])
            assert {*kind.sizes, *kind.drawn} <= set(parameters)
            own = [key for key in drawn_values(name, 1.0, paper, np.random.default_rng(0)) if key not in parameters]
            assert all(key.startswith("own_") for key in own)
            if not kind.met and name not in KNOWN_SINCE:
                assert all(kind.sizes[key] == parameters[key].value for key in kind.sizes)


def test_severity_scales_towards_doing_nothing(paper):
    for name, kind in STRUCTURAL.items():
        if kind.met or name == "rotor_inertia":
            continue
        whole, eighth = (drawn_values(name, s, paper, np.random.default_rng(5)) for s in (1.0, 0.125))
        for key in kind.sizes:
            assert eighth[key] - kind.neutral == pytest.approx(0.125 * (whole[key] - kind.neutral))


def test_the_first_sets_of_each_stratum_are_balanced():
    for stratum in STRATA:
        if stratum == "sheet" or stratum in ONE_SENSOR:  # of one tolerance; of other sensors, and an odd rate
            continue
        found = [designed(stratum, seed) for seed in range(12)]
        for levels, of in ((EXCITATIONS, "excitation"), (RATES, "rate"), (SENSORS, "sensors")):
            counts = [sum(getattr(each, of) == level for each in found) for level in levels]
            assert len(set(counts)) == 1


@pytest.mark.parametrize("stratum", ONE_SENSOR)
def test_each_item_of_real_sensors_is_there_once_in_each_block(stratum):
    found = [designed(stratum, seed) for seed in range(8, 16)]
    assert {each.sensors for each in found} == set(ITEMS)
    assert all((each.rate in RATES) == (each.sensors != "odd rate") for each in found)


@pytest.mark.parametrize("item", ITEMS[:-1])
def test_what_is_real_alone_is_as_real_as_among_all_and_the_rest_is_ideal(item, paper):
    alone, ideal, real = (drawn_sensors(q, paper, np.random.default_rng(3))._asdict() for q in (item, "ideal", "real"))
    changed = {name for name, value in alone.items() if value != ideal[name]}
    expected = {
        "tilt filter": {"acceleration", "tilt_constant", "height"},
        "coarse encoder": {"wheel_rate", "ticks", "differenced"},
        "shaft encoder": {"on_shaft"},
    }
    assert changed == expected.get(item, set())
    assert all(alone[name] == real[name] for name in changed - {"on_shaft"})


@pytest.mark.slow
def test_without_play_an_encoder_on_the_shaft_sees_what_one_on_the_wheel_does(sheets):
    seed = next(s for s in range(99) if designed("sensors clean", s).sensors == "shaft encoder")
    each = designed("sensors clean", seed)
    sheet = replace(sheets[each.sheet], control_period=1.0 / each.rate)
    on_shaft, on_wheel = driven(each, sheet), driven(each._replace(sensors="odd rate"), sheet)
    for shaft, wheel in zip(on_shaft.rollouts, on_wheel.rollouts, strict=True):
        np.testing.assert_allclose(shaft.seen, wheel.seen, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("item", "period"), [("odd rate", 0.03), ("odd rate", 1.0 / 70.0), ("jitter", 0.02)])
def test_a_loop_keeps_its_period_in_the_mean_whatever_that_is(item, period, sheets):
    seed = next(
        s for s in range(99) if (e := designed("sensors clean", s)).sensors == item and round(e.rate * period, 9) == 1
    )
    each = designed("sensors clean", seed)
    sheet = replace(sheets[each.sheet], control_period=1.0 / each.rate)
    times = driven(each, sheet).rollouts[0].seen[:, 0]
    assert np.mean(np.diff(times)) == pytest.approx(sheet.control_period, rel=1e-3)
    assert (np.ptp(np.diff(times)) > 2.1 * STEP) == (item == "jitter")


def test_names_of_sets_differ():
    names = [each.name for each in sets(STRATA, range(50))]
    assert len(set(names)) == len(names) == 50 * len(STRATA)
    assert not set(names) & {each.bare().name for each in sets(STRATA, range(50))}


def test_a_bare_set_is_the_same_robot_and_loop_without_the_effect(sheets):
    each = designed("single 1/8", 1)
    sheet = replace(sheets[each.sheet], control_period=1.0 / each.rate)
    found, bare = driven(each, sheet), driven(each.bare(), sheet)
    assert not bare.hidden
    ((name, values),) = found.hidden.items()
    assert put(name, values, bare.robot, bare.sensors) == (found.robot, found.sensors)


@pytest.mark.parametrize(
    ("value", "said"), [(1.0, 0.9), (-1.0, 0.9), (0.5, 0.5), (0.1, 0.1), (2**-0.5, 0.7), (9.0, 1.0)]
)
def test_what_was_said_of_a_size_lies_between_what_is_listed(value, said):
    sizes = [(0.25, 0.1), (0.5, 0.5), (1.0, 0.9), (2.0, 1.0)]
    listed = [{"share": share, "value": share, "probability": p} for share, p in sizes]
    assert said_at(listed, value) == pytest.approx(said)
    shifted = [{**each, "value": 1.0 + 0.1 * each["share"]} for each in listed]  # a factor, of which 1 is none
    assert said_at(shifted, 1.0 + 0.1 * value) == pytest.approx(said)


def test_a_lower_limit_is_a_larger_effect_in_what_was_said():
    sizes = [(0.5, 0.1), (1.0, 0.5), (2.0, 0.9)]
    listed = [{"share": share, "value": 3.0 / share, "probability": p} for share, p in sizes]
    assert [said_at(listed, value) for value in (60.0, 6.0, 3.0, 1.5, 0.1)] == pytest.approx([0.1, 0.1, 0.5, 0.9, 0.9])


def test_the_table_of_power_counts_what_was_found_by_what_was_said():
    known = {"effect": "backlash", "value": 1.0}
    rows = [(0.99, 0.9), (1.0, 0.4), (0.5, 0.9), (0.0, 0.0), (None, 0.9)]
    power = {"power": [{**known, "said": said, "found": found} for said, found in rows]}
    _, _, unlikely, even, sure = detection_power(power)
    assert unlikely.startswith("| 0.00-0.05 | 1 | 0.00 | 0 of 1")
    assert even.startswith("| 0.35-0.65 | 1 | 0.50 | 1 of 1")
    assert sure.startswith("| 0.95-1.00 | 2 | 0.99 | 1 of 2")


@pytest.mark.slow
@pytest.mark.parametrize(("stratum", "seed"), [("pairs", 0), ("single 1/8", 1), ("eight", 0), ("sensors 1/4", 3)])
def test_the_same_seed_gives_the_same_bytes_and_a_complete_label(stratum, seed, sheets, tmp_path):
    each = designed(stratum, seed)
    sheet = replace(sheets[each.sheet], control_period=1.0 / each.rate)
    first, second = (record(each, sheet, tmp_path / place) for place in "ab")
    assert first == second
    files = sorted((tmp_path / "a" / "episodes").glob("*.mcap"))
    assert files and all(f.read_bytes() == (tmp_path / "b" / "episodes" / f.name).read_bytes() for f in files)
    assert first["stays_up"] and set(first["hidden"]) == set(each.effects)
    for name, values in first["hidden"].items():
        assert {*ALL[name].sizes, *ALL[name].drawn, *ALL[name].own} == set(values)
        assert np.isfinite(list(values.values())).all()
    total = sum(len(read_episode(file).commands) for file in files)
    assert total >= 0.98 * 40.0 * each.rate


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_a_clean_robot_stays_up_in_all_its_episodes(seed, sheets):
    each = designed("clean", seed)
    found = driven(each, replace(sheets[each.sheet], control_period=1.0 / each.rate))
    assert found.stays_up and found.gentler == 1.0 and not found.hidden


def test_the_table_of_lost_commands_counts_what_was_told_and_whether_intervals_hold():
    rows = [
        {"excitation": "E", "lost": [0.0, None]},
        {"excitation": "N", "lost": [0.0, [0.01, 0.005, 0.02]]},
        {"excitation": "E", "lost": [0.05, [0.05, 0.04, 0.06]]},
        {"excitation": "N", "lost": [0.06, [0.04, 0.03, 0.05]]},
        {"excitation": "N", "lost": [0.07, None]},
    ]
    _, _, none, some = other_robots_lost({"sets": [{"verdict": "none", **row} for row in rows]})
    assert none.startswith("| none | 2 | 1 of 2")
    assert some.startswith("| 3 to 10 % | 3 | 2 of 3")
    assert "| 1 of 2 (1-99 %) | 1 of 1" in some


def test_commands_that_are_lost_are_in_the_label_and_in_what_was_said():
    each = designed("lost", 3)
    assert list(each.effects) == ["command_loss"] and 1 / 32 <= each.effects["command_loss"] <= 1
    label = {**each._asdict(), "hidden": {"command_loss": {"share": 0.1}}, "gentler": 1.0, "stays_up": True}
    label["sensor_values"] = {"tilt_constant": 0.0}
    told = {"effects": [], "verdict": "none", "schema": 2, "remaining": {"is_beyond_noise": False}}
    said = {"share": 0.09, "low95": 0.08, "high95": 0.11, "lost": 9, "tested": 100}
    assert judged(label, {**told, "lost_commands": said}, 1.0)["lost"] == [0.1, [0.09, 0.08, 0.11]]
    assert judged(label, {**told, "lost_commands": None}, 1.0)["lost"] == [0.1, None]
    assert judged(label, None, 1.0)["lost"] == [0.1, None]
