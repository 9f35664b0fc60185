"""Runs one stage under Hydra and lets its errors come out as errors of twbal."""

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import hydra
import yaml
from hydra._internal.hydra import Hydra
from hydra.errors import HydraException
from omegaconf.errors import OmegaConfBaseException

from twbal.cli import settings_help  # noqa: F401, help asks for it
from twbal.cli.composition import register_nodes
from twbal.cli.conf_folder import conf_folder
from twbal.cli.flags import with_flags
from twbal.cli.hydra_errors import explained, refused_by_hydra, unreadable_yaml
from twbal.cli.own_choices import refuse_packaged_names
from twbal.cli.refused_words import refuse_words
from twbal.cli.robot_words import with_sheet_folder
from twbal.cli.sim_files import with_files
from twbal.cli.sweeps import FailedJobError, Job, StageFailed, SweepEnded, full_error, translated, with_job_folders


def run_stage(stage: str, words: list[str], program: str) -> None:
    """Run `stage` with Hydra's arguments `words`.

    Args:
        stage: its name on the command line.
        words: overrides and Hydra's flags.
        program: what Hydra takes for the program's name.

    Raises:
        TwbalError: the configuration, the stage or a job of a sweep failed.
        SystemExit: a flag of Hydra's ended the run.
    """
    refuse_words(words)
    name = stage.replace("-", "_")
    words = with_sheet_folder(words)
    refuse_packaged_names(words)
    sys.argv = [program, *_overrides_first(with_job_folders(with_files(words)))]
    register_nodes()
    job = Job(stage)
    try:
        with _composed_once(words), full_error("1"):  # Hydra then raises errors instead of printing them and leaving
            hydra.main(version_base="1.3", config_path=str(conf_folder()), config_name=name)(job)()
    except StageFailed as failed:
        raise translated(failed.error, stage) from failed.error
    except SweepEnded as ended:
        raise job.ended(ended.failure, words) from ended
    except FailedJobError as failed:
        raise job.failures(failed, words) from failed
    except (HydraException, OmegaConfBaseException) as error:
        raise explained(error, stage) from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:  # not of the stage, whose errors are in a StageFailed
        raise unreadable_yaml(error) from error
    except ValueError as error:
        refused = refused_by_hydra(error, words)
        if refused is None:
            raise
        raise refused from error


@contextmanager
def _composed_once(words: Sequence[str]) -> Iterator[None]:
    """Keep Hydra from composing a configuration once more before, only to see whether that sets `hydra.mode`.

    Nothing in conf/ does; where words or files from elsewhere may, Hydra looks.
    """
    look = Hydra.get_mode
    if not any(word.startswith(("--c", "-c")) or "hydra.mode" in word or "hydra.searchpath" in word for word in words):
        Hydra.get_mode = lambda *_, **__: None  # type: ignore[method-assign]
    try:
        yield
    finally:
        Hydra.get_mode = look  # type: ignore[method-assign]


def _overrides_first(words: list[str]) -> list[str]:
    """`words` with the overrides before Hydra's flags, whose parser does not take overrides on both sides of a flag."""
    return [word.text for word in sorted(with_flags(words), key=lambda word: bool(word.flag))]
