"""Episodes of a robot, kept also where they were cut short."""

from itertools import count
from pathlib import Path
from tempfile import mkdtemp

from twbal.core.episode import Episode, Outcome
from twbal.core.errors import DataError, LinkLostError
from twbal.io.logs import write_episode

INTERRUPTED = (Outcome.STOPPED, Outcome.LINK_LOST, Outcome.POLICY_FAULT)
"""Outcomes of trials that end the stage, and that the same command drives again."""

MOTORS_OFF = "The robot confirmed that its motors are off."
"""Holds of all outcomes but a lost link: a robot that does not confirm its stop ends as one."""


def what_is_kept(out: Path) -> str:
    """What an earlier start of the same command left in a run folder, as a sentence; that is not driven again."""
    complete, short = (len(list((out / name).glob("*.mcap"))) for name in ("episodes", "interrupted"))
    if not complete + short:
        return "an earlier start was cut short; nothing of it is kept"
    return f"an earlier start was cut short; trials kept: {complete} whole, {short} interrupted"


def keep(file: Path, episode: Episode) -> None:
    """Log the episode, also where Ctrl-C comes while it is written.

    Raises:
        DataError: it cannot be written there, such as on a full disk; the message says where it is.
    """
    try:
        _write(file, episode)
    except DataError as error:
        raise DataError(f"{error} {_samples(episode)} {_rescued(file, episode)}") from error


def keep_interrupted(episode: Episode, folder: Path, why: str) -> None:
    """Log what there is of the episode under a free name, and raise what ended it."""
    name = f"trial_{episode.provenance.trial:03d}_{episode.outcome.value}"
    file = next(path for i in count() if not (path := folder / f"{name}_{i}.mcap").exists())
    try:
        _write(file, episode)
        kept = f"{_samples(episode)} are kept in {file}, marked {episode.outcome.replace('_', ' ')}"
    except DataError as error:  # must not hide what ended the episode
        kept = f"{error} {_samples(episode)} {_rescued(file, episode)}".removesuffix(".")
    if episode.outcome is Outcome.LINK_LOST:
        raise LinkLostError(f"{why} {kept}; the same command, with hydra.run.dir= of this run, goes on from there.")
    if episode.outcome is Outcome.POLICY_FAULT:
        raise DataError(f"{why} {MOTORS_OFF} {kept}. Make that policy anew, or choose another.")
    print(f"{MOTORS_OFF} {kept}")
    raise KeyboardInterrupt


def _samples(episode: Episode) -> str:
    return f"{len(episode)} samples of trial {episode.provenance.trial}"


def _write(file: Path, episode: Episode) -> None:
    try:
        write_episode(file, episode)
    except KeyboardInterrupt:
        write_episode(file, episode)
        raise


def _rescued(file: Path, episode: Episode) -> str:
    """Log what has no place in its folder to the temporary folder; what came of that, as the end of a sentence."""
    try:
        folder = Path(mkdtemp(prefix="twbal-"))
    except OSError:
        return "are lost."
    try:
        _write(folder / file.name, episode)
    except DataError:
        folder.rmdir()
        return "are lost."
    return f"are kept in {folder / file.name}: move that to {file}."
