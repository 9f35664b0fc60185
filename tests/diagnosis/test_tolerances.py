import pytest
from hydra.utils import instantiate
from omegaconf import OmegaConf

from twbal.cli.conf_folder import conf_folder
from twbal.diagnosis.candidates import always_free
from twbal.diagnosis.data_sheet import DATA_SHEET, WHEELS
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.hypothesis import is_at_bound
from twbal.diagnosis.settings import Tolerances
from twbal.planar.parameters import planar_parameters

PUBLISHED, ROUGH = 0.03, 0.15
TOLERANCES = Tolerances(PUBLISHED, ROUGH, 0.0003, 0.00025, 0.0, 0.0, 0.0, 0.15)


def robot(name):
    return instantiate(OmegaConf.load(conf_folder() / "robot" / f"{name}.yaml"))


@pytest.mark.parametrize("name", ["paper", "regbot"])
def test_published_values_have_the_tolerance_of_published_values(name):
    found = TOLERANCES.for_robot(robot(name))
    assert {found.of(field) for field in (*DATA_SHEET, *WHEELS)} == {PUBLISHED}


def test_measured_values_have_half_of_it_and_guessed_ones_what_a_rough_sheet_has():
    found = TOLERANCES.for_robot(robot("lego"))
    assert found.of("com_height_factor") == 0.5 * PUBLISHED
    assert found.of("body_inertia_factor") == 2 * PUBLISHED
    assert found.of("wheel_inertia") == ROUGH


def test_no_tolerance_that_follows_from_a_provenance_is_larger_than_that_of_a_rough_sheet():
    loose = Tolerances(0.1, ROUGH, 0.0003, 0.00025, 0.0, 0.0, 0.0, 0.15).for_robot(robot("tumbller"))
    assert max(loose.of(field) for field in (*DATA_SHEET, *WHEELS)) == ROUGH
    own = Tolerances(0.3, ROUGH, 0.0003, 0.00025, 0.0, 0.0, 0.0, 0.15)
    assert own.of("body_mass_factor") == 0.3  # as the user says


def test_a_fit_takes_them_for_standard_deviations():
    lego = robot("lego")
    free_parameters = always_free(TOLERANCES.for_robot(lego), planar_parameters(lego, {}), 1)
    sds = {free.field: free.sd / free.mean for free in free_parameters if free.field in (*DATA_SHEET, *WHEELS)}
    assert sds["com_height_factor"] == pytest.approx(0.015)
    assert sds["wheel_inertia"] == pytest.approx(0.15)


def test_sizes_of_effects_that_the_simulation_has_are_free_within_a_share_of_themselves():
    paper = robot("paper")
    effects = {
        "viscous_friction": {"coefficient": 0.02},
        "com_offset": {"angle": -0.01},
        "cogging": {"torque": 0.1, "count": 13.0, "phase": 1.0},
        "torque_saturation": {"limit": 4.0},
        "gyro_scale": {"factor": 1.05},
        "imu_delay": {"delay": 0.004},
    }
    given = [candidate for candidate in candidates_for(paper) if candidate.name in effects]
    planar = planar_parameters(paper, effects)
    without = {free.field for free in always_free(TOLERANCES, planar, 1)}
    free = {each.field: each for each in always_free(TOLERANCES, planar, 1, given=given)}
    sizes = {"viscous_friction_coefficient": 0.02, "com_offset_angle": -0.01, "cogging_torque": 0.1}
    sizes |= {"torque_saturation_limit": 4.0}
    assert set(free) - without == set(sizes)
    for field, value in sizes.items():
        assert free[field].mean == value and free[field].sd == pytest.approx(0.15 * abs(value))
        assert free[field].low < value < free[field].high and not is_at_bound(free[field], value)
    late = free["imu_delay_delay"]
    assert late.mean == 0.004 and late.sd == pytest.approx((0.0003**2 + 0.0006**2) ** 0.5)
