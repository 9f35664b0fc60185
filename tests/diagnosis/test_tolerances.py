import pytest
from hydra.utils import instantiate
from omegaconf import OmegaConf

from twbal.cli.conf_folder import conf_folder
from twbal.diagnosis.candidates import always_free
from twbal.diagnosis.data_sheet import DATA_SHEET, WHEELS
from twbal.diagnosis.settings import Tolerances
from twbal.planar.parameters import planar_parameters

PUBLISHED, ROUGH = 0.03, 0.15
TOLERANCES = Tolerances(PUBLISHED, ROUGH, 0.0003, 0.00025, 0.0, 0.0, 0.0)


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
    loose = Tolerances(0.1, ROUGH, 0.0003, 0.00025, 0.0, 0.0, 0.0).for_robot(robot("tumbller"))
    assert max(loose.of(field) for field in (*DATA_SHEET, *WHEELS)) == ROUGH
    assert Tolerances(0.3, ROUGH, 0.0003, 0.00025, 0.0, 0.0, 0.0).of("body_mass_factor") == 0.3  # as the user says


def test_a_fit_takes_them_for_standard_deviations():
    lego = robot("lego")
    free_parameters = always_free(TOLERANCES.for_robot(lego), planar_parameters(lego, {}), 1)
    sds = {free.field: free.sd / free.mean for free in free_parameters if free.field in (*DATA_SHEET, *WHEELS)}
    assert sds["com_height_factor"] == pytest.approx(0.015)
    assert sds["wheel_inertia"] == pytest.approx(0.15)
