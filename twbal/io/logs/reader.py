"""MCAP files into episodes: whole ones, and what is left of damaged ones."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from twbal.core.episode import Episode, Event, Outcome
from twbal.core.errors import DataError, LogError
from twbal.core.files import read_bounded
from twbal.io.logs.contents import Contents, find_description
from twbal.io.logs.metadata import METADATA_NAME, Description
from twbal.io.logs.records import MAGIC, DamageError
from twbal.io.logs.rows import observations_of

_LARGEST = 2**32  # bytes of a file


class Recovered(NamedTuple):
    """What was saved from a log.

    Attributes:
        episode: its first samples. Where any are lost it counts as stopped, and its last event says so.
        lost_samples: how many samples of the log are not in it.
        damage: what is wrong with the file; empty if nothing is.
    """

    episode: Episode
    lost_samples: int
    damage: str


def read_episode(path: Path) -> Episode:
    """Read a log that `write_episode` wrote; every number comes back bit by bit.

    Raises:
        LogError: the file is missing, not MCAP, cut, damaged, foreign, of another schema version, or holds a sample
            that cannot be used.
    """
    contents, description, damage = _opened(path)
    if damage:
        good, samples = _complete_samples(contents), description.samples
        advice = "`twbal repair` saves those" if good else "take a copy, or record it again"
        raise LogError(f"Log {path} {damage}. {good} of its {samples} samples are complete; {advice}.")
    _check_complete(path, contents)
    return _episode(path, contents, description.samples)


def read_control_period(path: Path) -> float:
    """The control period of a log [s], without its samples being read.

    Raises:
        LogError: as of `read_episode`, where the log does not say it.
    """
    try:
        found = find_description(_load(path))
    except (DataError, DamageError):
        found = None
    return read_episode(path).control_period if found is None else found.control_period


def recover_episode(path: Path) -> Recovered:
    """Read what is left of a log, also of one that is whole.

    Raises:
        LogError: the file is missing, foreign, of another schema version, or has no complete sample.
    """
    contents, description, damage = _opened(path)
    good, samples = _complete_samples(contents), description.samples
    if good < 1:
        raise LogError(f"Log {path} {damage or 'is empty'}. None of its {samples} samples is complete; take a copy.")
    episode = _episode(path, contents, good)
    lost = samples - good
    if lost:
        text = f"log damaged: {lost} of {samples} samples lost, outcome was {episode.outcome.value}"
        events = (*episode.events, Event(float(episode.observations[-1, 0]), text))
        episode = replace(episode, outcome=Outcome.STOPPED, events=events)
    return Recovered(episode, lost, damage)


def read_episodes(source: Path | Sequence[Path]) -> list[Episode]:
    """Read all logs of a folder, or these files, sorted by name.

    Raises:
        LogError: there is no such folder, no log in it, or one of them cannot be read.
    """
    return [read_episode(path) for path in _log_files(source)]


def _log_files(source: Path | Sequence[Path]) -> list[Path]:
    if not isinstance(source, Path):
        files = sorted(source, key=lambda path: path.name)
        if not files:
            raise LogError("No episode logs were given. Give a folder, or the *.mcap files in it.")
        return files
    if source.is_file():
        return [source]
    if not source.is_dir():
        raise LogError(
            f"There is no folder {source}. Give the folder of episodes that a stage wrote, such as "
            "outputs/sim-collect/<date>_<time>/episodes."
        )
    files = sorted(source.glob("*.mcap"))
    if not files:
        there = sorted(entry.name + "/" * entry.is_dir() for entry in source.iterdir())
        found = ", ".join(there[:8]) + (", ..." if len(there) > 8 else "") if there else "nothing"
        raise LogError(
            f"Folder {source} has no episode logs (*.mcap); it holds: {found}. Give the folder with the logs."
        )
    return files


def _load(path: Path) -> bytes:
    try:
        data = read_bounded(path, _LARGEST)
    except FileNotFoundError:
        raise LogError(f"There is no log {path}. Check the path, or run the stage that records it.") from None
    except OSError as error:
        raise LogError(f"Cannot read log {path}: {error.strerror or error}.") from error
    if not data.startswith(MAGIC[: len(data)]):
        raise LogError(
            f"{path} is not an MCAP file (it begins with {data[:8]!r}). Give an episode log that a twbal stage wrote."
        )
    return data


def _opened(path: Path) -> tuple[Contents, Description, str]:
    """What is in a log, what it says of its episode, and what is wrong with its bytes; see `_damage`."""
    data = _load(path)
    try:
        contents = Contents(data)
    except DataError as error:
        raise LogError(f"Log {path} {error}.") from error
    damage = _damage(data, contents)
    if contents.description is None:
        raise LogError(_without_episode(path, contents, damage))
    return contents, contents.description, damage


def _damage(data: bytes, contents: Contents) -> str:
    """What is wrong with the bytes, as the end of a sentence; empty if nothing is."""
    if len(data) <= len(MAGIC) or not data.endswith(MAGIC):
        return f"is cut: {contents.damage or f'it ends after {len(data)} bytes, before the end of the data'}"
    return f"is damaged: {contents.damage}" if contents.damage else ""


def _without_episode(path: Path, contents: Contents, damage: str) -> str:
    topics = ", ".join(contents.topics) or "none"
    if damage:
        return (
            f"Log {path} {damage}. No sample of an episode can be recovered (topics found: {topics}); take a copy, or "
            "record it again."
        )
    return (
        f"{path} is an MCAP file, but not an episode log of twbal: it has no metadata record {METADATA_NAME!r}. "
        f"Its topics: {topics}. Give an episode log that a twbal stage wrote."
    )


def _complete_samples(contents: Contents) -> int:
    """How many samples from the first on have all their messages, and a command from each to the next."""
    if contents.description is None:
        return 0
    *seen, command = (len(values) for values in contents.columns.values())
    return min(*seen, command + 1, contents.description.samples)


def _check_complete(path: Path, contents: Contents) -> None:
    assert contents.description is not None
    samples, events = contents.description.samples, contents.description.events
    *seen, command = contents.columns
    expected = {**dict.fromkeys(seen, samples), command: samples - 1}
    for topic, values in contents.columns.items():
        if expected[topic] and topic not in contents.topics:
            raise LogError(f"Log {path} has no topic {topic!r}; it has: {', '.join(contents.topics) or 'none'}.")
        if len(values) != expected[topic]:
            raise LogError(
                f"Log {path} should have {expected[topic]} messages on {topic}, and {len(values)} follow each other "
                "without a gap. Did another tool cut it? `twbal repair` saves what is complete."
            )
    if len(contents.events) != events:
        raise LogError(
            f"Log {path} should have {events} events and has {len(contents.events)}. Did another tool cut it?"
        )


def _episode(path: Path, contents: Contents, samples: int) -> Episode:
    """The episode of the first `samples` samples."""
    found = contents.description
    assert found is not None
    columns = contents.columns
    seen = np.hstack([columns["/imu"][:samples], columns["/wheels"][:samples]])
    poses, references, headings = (columns.get(topic) for topic in ("/pose", "/reference", "/heading"))
    try:
        return Episode(
            channels=found.channels,
            control_period=found.control_period,
            observations=observations_of(seen),
            states=columns["/state"][:samples],
            commands=columns["/command"][: samples - 1, 0],
            outcome=found.outcome,
            provenance=replace(found.provenance, config=contents.config),
            events=contents.events,
            estimated=found.estimated,
            poses=None if poses is None else poses[:samples],
            references=None if references is None else references[:samples],
            headings=None if headings is None else headings[:samples],
        )
    except DataError as error:
        raise LogError(f"Log {path} cannot be used. {error}") from error
