"""Runs one stage under Hydra and lets its errors come out as errors of twbal."""

import importlib
import os
import sys

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException
from hydra.types import RunMode
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException

from twbal.configuration import conf_folder
from twbal.stages.complaints import complaint

_FULL_ERROR = "HYDRA_FULL_ERROR"
_asked_for_full_errors = os.environ.get(_FULL_ERROR) == "1"


class StageFailed(BaseException):
    """Carries a stage's error past Hydra, which would print its own line about it first.

    Not an `Exception`, so that Hydra lets it pass. Only for single runs: in a sweep Hydra must see that a job failed, to go
    on with the others.
    """

    def __init__(self, error: Exception) -> None:
        super().__init__(str(error))
        self.error = error


def full_errors_wanted() -> bool:
    """Whether the person asked for tracebacks, before this module turned Hydra's own printing off."""
    return _asked_for_full_errors


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
    # Hydra then raises errors instead of printing them and leaving.
    os.environ[_FULL_ERROR] = "1"
    sys.argv = [program, *words]

    def task(cfg: DictConfig) -> None:
        try:
            # Imported here: help, tab completion and --cfg need none of the libraries that a stage works with.
            importlib.import_module(f"twbal.stages.{name}").main(cfg)
        except Exception as error:
            if HydraConfig.get().mode == RunMode.MULTIRUN:
                raise
            raise StageFailed(error) from error

    try:
        hydra.main(version_base="1.3", config_path=str(conf_folder()), config_name=name)(task)()
    except StageFailed as failed:
        raise _translated(failed.error, stage) from failed.error
    except (HydraException, OmegaConfBaseException) as error:
        raise complaint(error, stage) from error


def _translated(error: Exception, stage: str) -> Exception:
    """`error` itself, or what it means to the person who typed the command."""
    return complaint(error, stage) if isinstance(error, HydraException | OmegaConfBaseException) else error
