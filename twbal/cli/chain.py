"""Stages run one after another within one run folder, with the commands that would do the same by hand."""

import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from hydra.errors import HydraException
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException

from twbal.cli.commands import ROOT, command_line, compose_stage, stage_overrides, text, tree_of
from twbal.cli.config_check import check_configuration
from twbal.cli.console import say
from twbal.cli.hydra_errors import explained
from twbal.cli.manifest import Manifest, now_utc, read_manifest
from twbal.cli.sim_files import with_files
from twbal.cli.stages import (
    fit_diff_gp,
    fit_sim_gp,
    identify,
    lqr,
    optimise_policy,
    real_rollout,
    sim_collect,
    train_agent,
)
from twbal.cli.trial_words import trial_in_words
from twbal.core.episode import Episode
from twbal.core.errors import TwbalError
from twbal.virtual_robot.process import Launch, launch


def _diagnose(cfg: DictConfig, out: Path) -> Manifest:
    from twbal.cli.stages import diagnose  # a second, and few runs diagnose anything

    return diagnose.run(cfg, out)


RUN: Mapping[str, Callable[[DictConfig, Path], Manifest]] = {
    "sim-collect": sim_collect.run,
    "fit-sim-gp": fit_sim_gp.run,
    "optimise-policy": optimise_policy.run,
    "lqr": lqr.run,
    "real-rollout": real_rollout.run,
    "train-agent": train_agent.run,
    "fit-diff-gp": fit_diff_gp.run,
    "identify": identify.run,
    "diagnose": _diagnose,
}


class StageCall(NamedTuple):
    """One stage to run.

    Attributes:
        stage: its name on the command line.
        folder: for its results, within the run folder.
        overrides: of what the configuration says, by key; a `Path` (or a list of them) lies within the run folder.
        choices: groups that are chosen for it, as `policy: saved`.
    """

    stage: str
    folder: Path
    overrides: Mapping[str, Any]
    choices: Mapping[str, str] = {}

    def words(self, root: Path) -> list[str]:
        """The overrides that say so, with paths from `root`."""
        chosen = [f"{group}={choice}" for group, choice in self.choices.items()]
        return [*chosen, *(f"{key}={text(_rooted(value, root))}" for key, value in self.overrides.items())]


class Chain:
    """Runs calls in a run folder; those that are done there already cost nothing.

    Attributes:
        root: the run folder.
        commands: a shell command for each call so far; `$OUT` stands for the run folder.
        outputs: what the calls made, by path within the run folder, with sha256.
    """

    def __init__(
        self,
        cfg: DictConfig,
        choices: Mapping[str, str],
        root: Path,
        flags: Sequence[str],
        launch: Launch = launch,
    ) -> None:
        """Run nothing yet.

        Args:
            cfg: of the stage that runs the others, with the groups that they share.
            choices: which choice `cfg` has of each group.
            root: the run folder.
            flags: of Hydra's that each command must have besides.
            launch: starts the virtual robot for a stage that drives it.
        """
        self.root = root
        self.commands: list[str] = []
        self.outputs: dict[str, str] = {}
        self._before_s = 0.0
        self._began, self._clock = now_utc(), time.monotonic()
        self._made: dict[Path, tuple[StageCall, Manifest]] = {}
        self._cfg, self._tree, self._choices, self._flags = cfg, tree_of(cfg), choices, list(flags)
        self._run: Mapping[str, Callable[[DictConfig, Path], Manifest]] = {
            **RUN,
            "real-rollout": partial(real_rollout.run, launch=launch, advise=False, tell=self._tell),
        }

    @property
    def wall_s(self) -> float:
        """How long it takes so far; calls that were there already count as long as each of them took then [s]."""
        return self._before_s + time.monotonic() - self._clock

    def _tell(self, trial: Episode) -> None:
        """Tell a person how a trial ended; there is none beside a virtual robot of the run's own."""
        if "port" in self._cfg.link:
            say(trial_in_words(trial))

    def run(self, call: StageCall) -> Manifest:
        """Run one stage, unless its folder says that it is done.

        Raises:
            TwbalError: of the stage's kind, with its name and folder before the message.
        """
        asked, manifest = self._made.get(call.folder, (None, None))
        if manifest is not None and asked == call:
            return manifest
        out = self.root / call.folder
        print(f"{call.stage} -> {out}", flush=True)
        began = time.monotonic()
        overrides, by_hand = call.words(self.root), call.words(ROOT)
        try:
            before = read_manifest(out)
            words = stage_overrides(call.stage, self._tree, self._choices, overrides)
            cfg = compose_stage(call.stage, with_files(words))
            check_configuration(cfg, call.stage)
            manifest = self._run[call.stage](cfg, out)
        except (HydraException, OmegaConfBaseException) as error:
            raise _named(explained(error, call.stage), call, out) from error
        except TwbalError as error:
            raise _named(error, call, out) from error
        kept = manifest == before
        wall_s = manifest.wall_s if kept else time.monotonic() - began
        is_old = kept and manifest.started < self._began  # else it was begun ahead, in this run
        print("  is there already" if is_old else f"  took {wall_s:.1f} s", flush=True)
        inherited = words[: len(words) - len(overrides)]
        self.commands.append(command_line(call.stage, [*self._flags, *inherited, *by_hand], ROOT / call.folder))
        self.outputs |= {(call.folder / made.path).as_posix(): made.sha256 for made in manifest.outputs}
        self._before_s += wall_s if is_old else 0.0
        self._made[call.folder] = call, manifest
        return manifest


def _named(error: TwbalError, call: StageCall, out: Path) -> TwbalError:
    """The same error, saying where it happened."""
    return type(error)(f"{call.stage} in {out}: {error}")


def _rooted(value: Any, root: Path) -> Any:
    """`value` as plain values, its paths from `root`."""
    if isinstance(value, Path):
        return str(root / value)
    return [_rooted(inner, root) for inner in value] if isinstance(value, list) else value
