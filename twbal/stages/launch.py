"""Runs one stage under Hydra and lets its errors come out as errors of twbal."""

import gc
import importlib
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException
from hydra.types import RunMode
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException

from twbal.configuration import conf_folder
from twbal.stages.complaints import complaint
from twbal.stages.sim_files import with_files

_FULL_ERROR = "HYDRA_FULL_ERROR"
_FLAGS_WITH_A_VALUE = (
    *("--cfg", "-c", "--info", "-i", "--package", "-p", "--config-path", "-cp", "--config-name", "-cn"),
    *("--config-dir", "-cd", "--experimental-rerun"),
)


class StageFailed(BaseException):
    """Carries a stage's error past Hydra, which would print its own line about it first.

    Not an `Exception`, so that Hydra lets it pass. Only for single runs: in a sweep Hydra must see that a job failed,
    to go on with the others.
    """

    def __init__(self, error: Exception) -> None:
        super().__init__(str(error))
        self.error = error


def run_stage(stage: str, words: list[str], program: str) -> None:
    """Run `stage` with Hydra's arguments `words`.

    Args:
        stage: its name on the command line.
        words: overrides and Hydra's flags.
        program: what Hydra takes for the program's name.

    Raises:
        TwbalError: the configuration or the stage failed.
        SystemExit: a flag of Hydra's ended the run.
    """
    name = stage.replace("-", "_")
    sys.argv = [program, *_overrides_first(with_files(words))]
    asked = os.environ.get(_FULL_ERROR)

    def task(cfg: DictConfig) -> None:
        try:
            # Imported here: help, tab completion and --cfg need none of the libraries that a stage works with.
            with _full_error(asked):  # for processes that the stage starts
                stage_module = importlib.import_module(f"twbal.stages.{name}")
                gc.enable()
                stage_module.main(cfg)
        except Exception as error:
            if HydraConfig.get().mode == RunMode.MULTIRUN:
                raise
            raise StageFailed(error) from error

    try:
        with _full_error("1"):  # Hydra then raises errors instead of printing them and leaving
            hydra.main(version_base="1.3", config_path=str(conf_folder()), config_name=name)(task)()
    except StageFailed as failed:
        raise _translated(failed.error, stage) from failed.error
    except (HydraException, OmegaConfBaseException) as error:
        raise complaint(error, stage) from error


def _overrides_first(words: list[str]) -> list[str]:
    """`words` with the overrides before Hydra's flags, whose parser does not take overrides on both sides of a flag."""
    overrides: list[str] = []
    flags: list[str] = []
    for before, word in zip(["", *words], words, strict=False):
        is_override = not word.startswith("-") and before not in _FLAGS_WITH_A_VALUE
        (overrides if is_override else flags).append(word)
    return overrides + flags


@contextmanager
def _full_error(value: str | None) -> Iterator[None]:
    """Set Hydra's variable for the length of the body; None takes it away."""
    before = os.environ.pop(_FULL_ERROR, None)
    try:
        if value is not None:
            os.environ[_FULL_ERROR] = value
        yield
    finally:
        os.environ.pop(_FULL_ERROR, None)
        if before is not None:
            os.environ[_FULL_ERROR] = before


def _translated(error: Exception, stage: str) -> Exception:
    """`error` itself, or what it means to the person who typed the command."""
    return complaint(error, stage) if isinstance(error, HydraException | OmegaConfBaseException) else error
