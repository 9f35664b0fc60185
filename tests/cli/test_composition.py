import copy
from concurrent.futures import ThreadPoolExecutor

import pytest
from hydra import compose
from hydra.core.config_store import ConfigStore
from hydra.core.global_hydra import GlobalHydra
from omegaconf import OmegaConf

import twbal
from twbal.cli.composition import composing, loaded, scaled
from twbal.cli.conf_folder import conf_folder

SIZES = {"wheel_radius": 0.15, "com_height": 0.3, "body_mass": 10.0, "body_inertia_pitch": 0.319}  # of `paper`
UNITS = {"m": (1, 0), "m.s": (1, 1), "m/s": (1, -1), "rad/s": (0, -1)}  # powers of length and of time


@pytest.mark.parametrize("unit", UNITS)
def test_a_robot_of_a_quarter_of_the_size_falls_in_half_the_time(unit):
    """Dynamic similarity under gravity: times go by the square root of lengths, inertias by mass and length squared."""
    assert scaled(2.5, unit, SIZES) == 2.5
    small = {
        "wheel_radius": 0.15 / 4,
        "com_height": 0.3 / 4,
        "body_mass": 10.0 / 64,
        "body_inertia_pitch": 0.319 / 64 / 16,
    }
    length, time = UNITS[unit]
    assert scaled(2.5, unit, small) == pytest.approx(2.5 * 0.25**length * 0.5**time, rel=1e-12)


def test_what_is_composed_in_the_midst_of_a_stage_leaves_that_its_hydra():
    with composing():
        running = GlobalHydra.instance().hydra
        with composing():
            assert compose("lqr").robot.name == "paper"
        assert GlobalHydra.instance().hydra is running


def test_copies_of_hydras_store_share_what_twbal_registers_and_each_composition_has_its_own():
    with composing():
        store = ConfigStore.instance()
        shared = store.repo["cost"]["paper.yaml"]
        assert copy.deepcopy(store).repo["cost"]["paper.yaml"] is shared  # a help text makes 180 such copies
        first, before = store.load("cost/paper.yaml").node, copy.deepcopy(shared.node)
        first[next(iter(first))] = None
        assert store.load("cost/paper.yaml").node == before


@pytest.mark.parametrize("file", [path.relative_to(conf_folder()) for path in conf_folder().rglob("*.yaml")], ids=str)
def test_files_are_read_as_omegaconf_reads_them(file):
    assert OmegaConf.create(loaded(conf_folder() / file)) == OmegaConf.load(conf_folder() / file)


@pytest.mark.parametrize(
    "number", ["1e-3", "2E5", "-1.e+3", "+4.5e-07", "1e3x", "10", "1.5", ".5", "e5", "1e", "0x1e5"]
)
def test_numbers_are_read_as_omegaconf_reads_them(tmp_path, number):
    (tmp_path / "a.yaml").write_text(f"a: {number}\n")
    found, expected = loaded(tmp_path / "a.yaml")["a"], OmegaConf.load(tmp_path / "a.yaml").a
    assert (found, type(found)) == (expected, type(expected))


def test_threads_compose_one_after_another():
    with ThreadPoolExecutor(4) as pool:
        setups = list(pool.map(lambda updates: twbal.setup("paper", [f"updates={updates}"]), range(6)))
    assert [setup.algorithm.updates for setup in setups] == list(range(6))
