"""Jobs of a sweep: where each lies, what one is, and what is told of those that fail.

Hydra itself does not resume sweeps. A job's folder is named by what the job was told, and a stage whose folder says
that its work is done returns at once: so the same sweep again, or a larger one, in the same folder does what is
missing.
"""

import gc
import hashlib
import importlib
import os
import re
import secrets
import shlex
import sys
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException
from hydra.experimental.callback import Callback
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from twbal.cli.commands import parsed, refuse_experiment_of_another_stage, text
from twbal.cli.config_check import check_configuration, refuse_unread
from twbal.cli.hydra_errors import explained
from twbal.cli.sweep_results import FAILURE, job_lines
from twbal.cli.swept_values import check_swept_values
from twbal.core.errors import ConfigError, LinkError, SweepError, TwbalError
from twbal.core.files import write_atomically
from twbal.core.threads import asked_threads

_FULL_ERROR = "HYDRA_FULL_ERROR"
_CHECKED_BY = "sweep"  # the name of `Announcement` in conf/base.yaml
_LONGEST = 160  # characters of a job folder's name, of the 255 that a file system takes
_LONGEST_OF_SWEPT = 80  # characters, where the name has swept keys alone
_DIGITS = 10  # of the hash in a name
_LISTED = 3  # failed jobs that are named one by one


def job_folder(overrides: Sequence[str], swept: Sequence[str] = (), sweep: str = "") -> str:
    """The name of a job's folder within that of its sweep: `link.seed-1__updates-2`, in alphabetical order.

    It has nothing that would have to be quoted in an override or a shell. What had to give way to that, was cut off
    for length or is not swept is told apart by a hash of all overrides: `link.seed-1_8f9a0c1d2e`. A folder that the
    sweep has already, maybe from when it swept other keys, is taken as it is.

    Args:
        overrides: of the job.
        swept: keys of those that differ among the jobs; the others are left out of the name. Empty: all are in it.
        sweep: folder of the sweep; "" looks for none.
    """
    whole = "__".join(sorted(overrides)).replace("=", "-")
    digest = hashlib.sha256(whole.encode()).hexdigest()[:_DIGITS]
    if not swept:
        return _folder_name(whole, whole, digest, _LONGEST)
    kept = [word for word in sorted(overrides) if word.partition("=")[0].lstrip("+~") in swept]
    name = _folder_name("__".join(kept).replace("=", "-"), whole, digest, _LONGEST_OF_SWEPT)
    before = [Path(sweep) / job_folder(overrides), *sorted(Path(sweep).glob(f"*_{digest}"))] if sweep else []
    return next((folder.name for folder in before if folder.is_dir()), name)


def _folder_name(text: str, whole: str, digest: str, longest: int) -> str:
    """What is told of the overrides as a name, with the hash where that is not the whole."""
    name = re.sub(r"[^\w.@-]", "_", text, flags=re.ASCII)[:longest]
    return name or "default" if name == whole else f"{name}_{digest}"


def with_job_folders(words: Sequence[str]) -> list[str]:
    """The words of a sweep, with the one that names the folders of its jobs by the keys that it sweeps.

    Others, and those of a person who names the folders, stay as they are.
    """
    if not {"-m", "--multirun"} & set(words) or any(word.startswith("hydra.sweep.subdir=") for word in words):
        return list(words)
    overrides = [parsed(word) for word in words if "=" in word and not word.startswith("-")]
    swept = [
        each.key_or_group for each in overrides if each and each.is_sweep_override() and not each.is_hydra_override()
    ]
    if not swept:
        return list(words)
    keys = ",".join(f"'{key}'" for key in swept)
    name = f"${{job_folder:${{hydra.overrides.task}},[{keys}],${{hydra.sweep.dir}}}}"
    return [*words, f'hydra.sweep.subdir="{name}"']


OmegaConf.register_new_resolver("job_folder", job_folder, replace=True)


class StageFailed(BaseException):
    """Carries a stage's error past Hydra, which would print its own line about it first.

    Not an `Exception`, so that Hydra lets it pass. Only for single runs: in a sweep Hydra must see that a job failed,
    to go on with the others.
    """

    def __init__(self, error: Exception) -> None:
        super().__init__(str(error))
        self.error = error


class FailedJobError(Exception):
    """A job of a sweep failed; crosses from the process that ran it to the one that sweeps."""

    def __init__(self, message: str, sweep: str) -> None:
        super().__init__(message, sweep)
        self.message, self.sweep = message, Path(sweep)

    def __str__(self) -> str:
        return self.message


class SweepEnded(BaseException):
    """Carries a failed job past Hydra, which would begin the next one.

    Not an `Exception`, so that Hydra lets it pass.
    """

    def __init__(self, failure: FailedJobError) -> None:
        super().__init__(failure)
        self.failure = failure


class Job:
    """What Hydra calls: for a single run, or for each job of a sweep, maybe in a process or on a machine elsewhere.

    Args:
        stage: its name on the command line.
    """

    def __init__(self, stage: str) -> None:
        self._stage, self._threads, self._full_error = stage, asked_threads(), os.environ.get(_FULL_ERROR)
        self._sweep = secrets.token_hex(8)  # tells failures of this go from those of earlier ones in the same folder
        self._is_elsewhere = False  # in a process that a launcher started

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._is_elsewhere = True
        os.environ.update(self._threads)  # in a process elsewhere, before it loads anything numeric

    def __call__(self, cfg: DictConfig) -> Any:
        """Run the stage.

        Raises:
            StageFailed: it failed, in a single run.
            FailedJobError: it failed, in a sweep.
            SweepEnded: it failed by a robot on a port, in a sweep of this process.
        """
        hydra = HydraConfig.get()
        sweeps = hydra.mode == RunMode.MULTIRUN
        try:
            refuse_experiment_of_another_stage(self._stage, hydra.runtime.choices)
            refuse_unread(cfg, self._stage, hydra.overrides.task)
            if sweeps or _CHECKED_BY not in hydra.callbacks:  # a single run was checked as it began
                check_configuration(cfg, self._stage, hydra)
            # Imported here: help, tab completion and --cfg need none of the libraries that a stage works with.
            from twbal.cli.console import overridden
            from twbal.cli.sheet_doubts import doubts_of

            sheet = None if overridden("robot.name") else hydra.runtime.choices.get("robot")
            for doubt in doubts_of(cfg, sheet):
                print(f"  WARNING: {doubt}", flush=True)
            with full_error(self._full_error):  # for processes that the stage starts
                stage_module = importlib.import_module(f"twbal.cli.stages.{self._stage.replace('-', '_')}")
                gc.enable()
                value = stage_module.main(cfg)
        except Exception as error:
            if not sweeps:
                raise StageFailed(error) from error
            failure = self._noted(error)
            if not _fails_by_robot(translated(error, self._stage), cfg):
                raise failure from error
            if not self._is_elsewhere:
                raise SweepEnded(failure) from error
            print(f"twbal: error: {failure}", file=sys.stderr, flush=True)  # the launcher tells it when all jobs ended
            raise failure from error
        if sweeps:
            (Path(HydraConfig.get().runtime.output_dir) / FAILURE).unlink(missing_ok=True)
        return value

    def _noted(self, error: Exception) -> FailedJobError:
        """`error` written down in the job's folder."""
        hydra, plain = HydraConfig.get(), translated(error, self._stage)
        overrides = " ".join(hydra.overrides.task)
        said = str(plain) if isinstance(plain, TwbalError) else f"{type(plain).__name__}: {plain}"
        said = " ".join(said.split())
        whole = "".join(traceback.format_exception(error))
        folder = Path(hydra.runtime.output_dir)
        write_atomically(folder / FAILURE, f"{overrides}\n{said}\nsweep {self._sweep}\n\n{whole}")
        return FailedJobError(said, hydra.sweep.dir)

    def ended(self, by: FailedJobError, words: Sequence[str]) -> SweepError:
        """What ended the sweep at one of its jobs, and the command that does what is missing.

        Args:
            by: failure of that job.
            words: with which the stage was called.
        """
        print("\n".join(job_lines(by.sweep)), flush=True)
        return SweepError(
            f"{by} So the sweep ended, and its next jobs were not begun, as they may drive that robot. Once that is "
            f"mended, this does what is missing: {again(self._stage, words, by.sweep)}"
        )

    def failures(self, first: FailedJobError, words: Sequence[str]) -> SweepError:
        """What failed in this sweep, and the command that does what is missing.

        Args:
            first: failure that Hydra told of.
            words: with which the stage was called.
        """
        print("\n".join(job_lines(first.sweep)), flush=True)
        files = sorted(first.sweep.glob(f"*/**/{FAILURE}"))
        logs = [lines for file in files if len(lines := file.read_text(encoding="utf-8").split("\n", 3)) == 4]
        ours = [f"{job or 'default'} ({said})" for job, said, sweep, _ in logs if sweep == f"sweep {self._sweep}"]
        more = f" and {len(ours) - _LISTED} more" if len(ours) > _LISTED else ""
        which = f"{'; '.join(ours[:_LISTED])}{more}" if ours else str(first)
        count = "1 job of the sweep" if len(ours) < 2 else f"{len(ours)} jobs of the sweep"
        return SweepError(
            f"{count} failed: {which}. The folder of each has a {FAILURE}. Once that is mended, this does what is "
            f"missing: {again(self._stage, words, first.sweep)}"
        )


def _fails_by_robot(error: Exception, cfg: DictConfig) -> bool:
    """Whether a robot on a port failed a job, which a person has to look after before the next one drives it."""
    return isinstance(error, LinkError) and "port" in (cfg.get("link") or {})


def again(stage: str, words: Sequence[str], sweep: Path) -> str:
    """The command that goes on with a sweep in its folder."""
    kept = [word for word in words if not word.startswith("hydra.sweep.dir=")]
    return shlex.join(["twbal", stage, *kept, f"hydra.sweep.dir={text(str(sweep))}"])


def translated(error: Exception, stage: str) -> Exception:
    """`error` itself, or what it means to the person who typed the command."""
    return explained(error, stage) if isinstance(error, HydraException | OmegaConfBaseException) else error


@contextmanager
def full_error(value: str | None) -> Iterator[None]:
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


def _refuse_other_folder(config: DictConfig) -> None:
    """Refuse to change into the run folder: paths of settings, and those that are printed, are from where one types."""
    if config.hydra.job.chdir:
        raise ConfigError(
            "hydra.job.chdir=true cannot be: paths that a command is given, and those that it prints, are from the "
            "folder in which it is typed. Leave it out; hydra.run.dir=<folder> says where results go."
        )


class Announcement(Callback):
    """Says at a sweep's begin how it goes on after an interruption; at its end what jobs came to, and what comes next.

    A single run begins with a check of its configuration, as Hydra has made no folder for it yet.
    """

    def on_run_start(self, config: DictConfig, **kwargs: Any) -> None:
        """Check the configuration.

        Raises:
            StageFailed: it cannot be right. (Hydra would make a warning of any other exception.)
        """
        try:
            _refuse_other_folder(config)
            check_configuration(config, config.hydra.job.name, config.hydra)
        except Exception as error:
            raise StageFailed(error) from error

    def on_multirun_start(self, config: DictConfig, **kwargs: Any) -> None:
        """Check the values that it lists, and print the sweep's folder.

        Raises:
            StageFailed: its jobs would not run in the folder of the command, or a value is out of its range.
        """
        try:
            _refuse_other_folder(config)
            words = OmegaConf.to_container(config.hydra.overrides.task, resolve=False)
            assert isinstance(words, list)
            check_swept_values(config.hydra.job.name, list(map(str, words)))
        except ConfigError as error:
            raise StageFailed(error) from error
        override = shlex.quote(f"hydra.sweep.dir={text(str(config.hydra.sweep.dir))}")
        print(f"After an interruption, this sweep goes on by the same command with {override}", flush=True)

    def on_multirun_end(self, config: DictConfig, **kwargs: Any) -> None:
        """Print the command that compares the jobs, where there is one."""
        print("\n".join([f"sweep {config.hydra.sweep.dir}", *job_lines(Path(config.hydra.sweep.dir))]))
        if config.hydra.job.name == "iterate":
            print(f"next  twbal compare {shlex.quote(f'runs={text(str(config.hydra.sweep.dir))}')}")
