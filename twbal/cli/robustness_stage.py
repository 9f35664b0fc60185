"""The part of `twbal compare` that drives policies on virtual robots which are changed."""

from collections.abc import Mapping, Sequence
from itertools import count
from pathlib import Path
from typing import NamedTuple

from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from twbal.algorithm.perturbations import Perturbations
from twbal.algorithm.robustness import (
    MethodRobustness,
    PolicyRobustness,
    Robustness,
    axes_of,
    policy_robustness,
    trials_of,
)
from twbal.cli.artefacts import POLICY_ENDING
from twbal.cli.console import Progress, say
from twbal.cli.manifest import StageWork, perform
from twbal.cli.policy_check import check_torque
from twbal.cli.tested_robots import FoundRobot, described, robot_of_link, robot_of_run
from twbal.cli.typed_config import recorded
from twbal.core.channels import Channels
from twbal.core.errors import DataError
from twbal.core.evaluation import SuccessCriterion
from twbal.core.files import write_atomically
from twbal.core.json_records import read_record, write_record
from twbal.core.text import aligned
from twbal.policies.saved import load_policy
from twbal.viz.canvas import svg
from twbal.viz.robustness_figure import robustness_figure
from twbal.viz.robustness_page import robustness_page, table_rows

NAME = "robustness"
_BEST = "best_policy.pt"


class Tested(NamedTuple):
    """A policy that is driven.

    Attributes:
        file: of it.
        found: its robot.
    """

    file: Path
    found: FoundRobot


def tested_policies(cfg: DictConfig, groups: Mapping[str, Sequence[Path]]) -> Mapping[str, Sequence[Tested]]:
    """The policies of all groups, with their robots.

    Args:
        cfg: of the stage.
        groups: policy files and folders of runs, by the name of their group.

    Raises:
        ConfigError: a robot is no virtual one, or its configuration has what is not taken here.
        DataError: a run has no policy, or does not say what it drove.
    """
    return {name: [_tested(path, cfg) for path in paths] for name, paths in groups.items()}


def compare_robustness(cfg: DictConfig, tested: Mapping[str, Sequence[Tested]], out: Path) -> list[Path]:
    """Drive the policies of all groups, and return what was made of it. A policy that is done is not driven again.

    Args:
        cfg: of the stage.
        tested: policies and their robots, by the name of their group.
        out: run folder.

    Raises:
        ConfigError: a policy commands more than its robot takes, or the folder holds the work of other settings.
    """
    perturbations: Perturbations = instantiate(cfg.perturbation)
    methods = []
    for number, (name, policies) in enumerate(tested.items()):
        driven = [
            _driven(each, cfg, perturbations, out / NAME / f"{number}_{index}", name)
            for index, each in enumerate(policies)
        ]
        methods.append(MethodRobustness(name, tuple(driven)))
    found = Robustness(cfg.seed, perturbations.trials, axes_of(perturbations), tuple(methods))
    if not found.on_same_robots:
        print("WARNING: the groups were not tried on the same robots; their shares do not compare.")
    return _written(found, out)


def _written(found: Robustness, out: Path) -> list[Path]:
    """Print and write all that is told."""
    print(*aligned(table_rows(found)), sep="\n")
    record, picture, page = (out / f"{NAME}.{ending}" for ending in ("json", "svg", "html"))
    drawn = svg(robustness_figure(found))
    write_record(record, found)
    write_atomically(picture, drawn)
    write_atomically(page, robustness_page(found, drawn))
    return [page, picture, record]


def _tested(path: Path, cfg: DictConfig) -> Tested:
    """A policy and its robot."""
    if path.suffix == POLICY_ENDING:
        if not path.is_file():
            raise DataError(f"There is no policy {path}. Give a policy.pt, or a run folder of `twbal iterate`.")
        return Tested(path, robot_of_link(cfg))
    if not (path / _BEST).is_file():
        raise DataError(f"{path} has no {_BEST}. Did its `twbal iterate` come to an end? Give the command again.")
    return Tested(path / _BEST, robot_of_run(path))


def _driven(tested: Tested, cfg: DictConfig, perturbations: Perturbations, folder: Path, name: str) -> PolicyRobustness:
    """What becomes of one policy, in a folder of its own."""
    robot = tested.found.robot
    asked = OmegaConf.create(
        {
            "robot": described(tested.found.cfg)["robot"],
            "tilt_limit": cfg.tilt_limit,
            "success": OmegaConf.to_container(cfg.success),
            "perturbation": OmegaConf.to_container(cfg.perturbation),
            "virtual_robot": described(tested.found.cfg),
        }
    )
    assert isinstance(asked, DictConfig)
    rule: SuccessCriterion = instantiate(asked.success)
    record = folder / f"{NAME}.json"

    def drive() -> list[Path]:
        policy = load_policy(tested.file)
        check_torque(policy, robot.sheet)
        channels = Channels(policy.channels, robot.sheet.wheel_radius, robot.sheet.control_period)
        say(f"{name}: {tested.file} on {robot.sheet.name} {robot.seed}")
        progress, number = Progress("trials", trials_of(perturbations)), count(1)
        found = policy_robustness(
            policy, channels, robot, perturbations, rule, cfg.seed, lambda: progress.show(next(number))
        )
        write_record(record, found)
        return [record]

    perform(StageWork("compare", folder, recorded(asked, ()), {"policy": [tested.file]}, cfg.seed), drive)
    return read_record(PolicyRobustness, record)
