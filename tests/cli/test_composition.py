import copy

from hydra.core.config_store import ConfigStore

from twbal.cli.composition import composing


def test_copies_of_hydras_store_share_what_twbal_registers_and_each_composition_has_its_own():
    with composing():
        store = ConfigStore.instance()
        shared = store.repo["cost"]["paper.yaml"]
        assert copy.deepcopy(store).repo["cost"]["paper.yaml"] is shared  # a help text makes 180 such copies
        first, before = store.load("cost/paper.yaml").node, copy.deepcopy(shared.node)
        first[next(iter(first))] = None
        assert store.load("cost/paper.yaml").node == before
