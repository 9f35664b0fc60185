"""The stage `real-rollout` without the command line around it, whose settings take longer to compose than a rollout."""

import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from hydra import compose
from omegaconf import DictConfig, OmegaConf

from twbal.cli.composition import composing
from twbal.cli.stages.real_rollout import run
from twbal.core.errors import TwbalError

_TRIAL, _FOLDER = "first_trial", "hydra.run.dir"


class Stage:
    """Command lines of `twbal real-rollout` that differ in their trial and run folder are composed once."""

    def __init__(self) -> None:
        self._composed: dict[tuple[str, ...], DictConfig] = {}

    def prepared(self, words: Sequence[str]) -> Callable[[], int]:
        """What runs the stage as this command line does, and returns its exit code; meant for a process of its own.

        Args:
            words: what follows `twbal`.
        """
        given = dict(word.split("=", 1) for word in words[1:])
        key = tuple(word for word in words[1:] if not word.startswith((f"{_TRIAL}=", f"{_FOLDER}=")))
        if key not in self._composed:
            with composing():
                self._composed[key] = compose("real_rollout", list(key))
        cfg = self._composed[key].copy()
        OmegaConf.update(cfg, _TRIAL, int(given[_TRIAL]))
        return partial(_run, cfg, Path(given[_FOLDER]))


def _run(cfg: DictConfig, out: Path) -> int:
    """As `twbal.cli.main.main` ends a stage; errors that are none of twbal's come out of it as they are."""
    try:
        run(cfg, out)
    except KeyboardInterrupt:
        print("twbal: stopped", file=sys.stderr)
        return 130
    except TwbalError as error:
        print(f"twbal: error: {error}", file=sys.stderr)
        return 1
    return 0
