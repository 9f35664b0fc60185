from omegaconf import OmegaConf

from benchmarks.methods.__main__ import FAST, MAIN, SEEDS, jobs, methods


def test_every_method_of_the_configuration_is_run_on_every_robot():
    found = jobs([3, 4])
    assert {method for method, _, _ in found} == set(OmegaConf.load("conf/groups/method.yaml"))
    assert {(m, r) for m, r, _ in found} == {(m, r) for m in methods() for r in (3, 4)}
    assert len(set(found)) == len(found)
    assert methods()[0] == MAIN
    assert set(methods()) > set(FAST)


def test_all_robots_come_before_a_second_seed_and_only_fast_methods_have_one():
    found = jobs([3, 4])
    seeds = [seed for _, _, seed in found]
    assert seeds == sorted(seeds)
    assert max(seeds) == SEEDS - 1
    assert {method for method, _, seed in found if seed} == set(FAST)
