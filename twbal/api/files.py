"""Policies, models and episodes in files."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from twbal import __version__
from twbal.algorithm import model_file
from twbal.api.arguments import check_list, check_path, check_policy, check_saved, check_whole
from twbal.api.sheets import RobotLike, sheet_of
from twbal.cli.artefacts import episode_files
from twbal.cli.composed import warn_of
from twbal.cli.policy_check import check_made_for
from twbal.cli.policy_origin import with_control_period
from twbal.core.channels import Channels
from twbal.core.episode import Episode
from twbal.core.files import file_hash
from twbal.core.streams import Stream, generator
from twbal.core.threads import one_thread
from twbal.embedded.board_export import Export, export_to
from twbal.io.checkpoint import save_checkpoint
from twbal.io.logs import read_episode
from twbal.models.dynamics import DynamicsModel
from twbal.policies import saved
from twbal.policies.saved import SavedPolicy

PathLike = str | Path
GivenEpisodes = PathLike | Sequence[Episode | PathLike]
"""Episodes, or what `read_episodes` reads."""

_TILT_LIMIT, _CHECKED = 0.5236, 20_000  # of the working range [rad], and states of it at which the header is checked


def load_policy(path: PathLike, channels: Sequence[str] | None = None) -> SavedPolicy:
    """The policy in a `policy.pt`, with the control period that it was made for where the file or its run folder tells.

    Args:
        path: of the file.
        channels: names of the state channels that it must read; None: whichever it reads.

    Raises:
        CheckpointError: the file cannot be read, or holds no policy.
        ConfigError: it is no path, or the policy reads other channels.

    >>> import twbal
    >>> policy = twbal.load_policy("data/regression/policy.pt")
    >>> policy.channels
    ('tilt', 'tilt_rate', 'speed', 'command_1', 'command_2')
    """
    check_path("path", path, "a policy.pt")
    return with_control_period(saved.load_policy(path, channels), Path(path))


def save_policy(path: PathLike, policy: SavedPolicy) -> str:
    """Write a policy as a `policy.pt`, which every command takes; returns the sha256 of the file.

    Raises:
        ConfigError: it is no policy that a file can hold, or the path is none.
        DataError: the file cannot be written.

    >>> import tempfile, twbal
    >>> policy = twbal.load_policy("data/regression/policy.pt")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     sha256 = twbal.save_policy(f"{folder}/policy.pt", policy)
    >>> len(sha256)
    64
    """
    check_path("path", path, "the policy.pt to write")
    check_saved(policy)
    return save_checkpoint(Path(path), "policy", policy.to_payload())


@one_thread
def export_policy(
    policy: SavedPolicy | PathLike, folder: PathLike, robot: RobotLike = "paper", distil: int | None = None
) -> Export:
    """Write a policy as a C header for the robot's own processor, with test vectors and a self-test beside it.

    Args:
        policy: the policy, or the path of a `policy.pt`.
        folder: for `policy.h`, `policy_vectors.h` and `policy_selftest.c`.
        robot: name of a packaged robot, path of a sheet, or nominal parameters; its wheel radius and control period
            enter the header.
        distil: basis functions that are left; None: all.

    Raises:
        CheckpointError: the policy cannot be read.
        ConfigError: it is of a kind that has no header, was made for another control period, or cannot be exported or
            made smaller so; or the folder is no path.
        DataError: the compiled header is not the policy; no file is written then.

    >>> import tempfile, twbal
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     made = twbal.export_policy("data/regression/policy.pt", folder, distil=6)
    >>> [(need.board, need.fits) for need in made.on_board.needs]
    [('ESP32', True), ('ATmega32U4', True)]
    """
    if distil is not None:
        check_whole("distil", distil, 0)
    check_path("folder", folder, "the folder to write into")
    check_policy(policy)
    read = load_policy(policy) if isinstance(policy, str | Path) else policy
    check_saved(read)
    sheet = sheet_of(robot)
    warn_of(check_made_for(read, sheet))
    channels = Channels(tuple(read.channels), sheet.wheel_radius, sheet.control_period)
    origin = f"Made by twbal {__version__} for {sheet.name}."
    return export_to(
        Path(folder), read, channels, sheet, _TILT_LIMIT, origin, generator(Stream.ON_BOARD, 0), distil, _CHECKED
    )


@one_thread
def load_model(path: PathLike) -> DynamicsModel:
    """The model of the dynamics, f + g, in a `model.pt`.

    Raises:
        CheckpointError: the file cannot be read, or holds no model.
        ConfigError: it is no path.

    >>> import numpy as np, twbal
    >>> model = twbal.load_model("data/regression/model.pt")
    >>> states = np.zeros((3, len(model.channels.names)))  # upright, at rest
    >>> model.step_mean(states, np.zeros(3)).shape
    (3, 5)
    """
    check_path("path", path, "a model.pt")
    return model_file.load_model(Path(path)).model


def read_episodes(paths: PathLike | Sequence[PathLike]) -> list[Episode]:
    """Episodes: source by source, and sorted by name within each.

    Args:
        paths: a log, a folder of logs or a run folder; or several of these.

    Raises:
        LogError: a source is not there, has no log in it, or a log cannot be read.

    Warns:
        UserWarning: two logs are the same recording.

    >>> import twbal
    >>> episodes = twbal.read_episodes("data/regression/real")
    >>> episodes[0].observations.shape[1]  # time, tilt, tilt rate, ...; see `twbal.core.plant.Observation`
    7
    """
    if not isinstance(paths, str | Path):
        check_list("paths", paths, (str, Path), "the path of a log or of a folder of logs, or a list of such paths")
    found = _read([paths] if isinstance(paths, str | Path) else paths)
    warn_of_duplicates(found)
    return [each.episode for each in found]


class GivenEpisode(NamedTuple):
    """An episode that was given to a function, as such or by a path.

    Attributes:
        name: for reports and errors.
        episode: it.
        recording: the same for two that are the same recording, as far as their files or objects tell.
    """

    name: str
    episode: Episode
    recording: str | int


def episodes_in(name: str, given: GivenEpisodes) -> list[GivenEpisode]:
    """Episodes that were given as such or by paths.

    Args:
        name: of the argument, in the singular.
        given: episodes, paths, or both.

    Raises:
        ConfigError: something else was given.
        LogError: see `read_episodes`.
    """
    if not isinstance(given, str | Path):
        example = "a list of episodes, or paths as twbal.read_episodes takes them"
        check_list(f"{name}s", given, (Episode, str, Path), example)
    found: list[GivenEpisode] = []
    for item in [given] if isinstance(given, str | Path) else given:
        found += [GivenEpisode(f"{name} {len(found)}", item, id(item))] if isinstance(item, Episode) else _read([item])
    return found


def warn_of_duplicates(given: Sequence[GivenEpisode]) -> None:
    """Warn where episodes are the same recording: it would count twice."""
    first: dict[str | int, str] = {}
    doubts = []
    for each in given:
        if each.recording in first:
            doubts.append(
                f"{each.name} is the same recording as {first[each.recording]}: it counts twice, so results look too "
                "sure."
            )
        first.setdefault(each.recording, each.name)
    warn_of(doubts)


def _read(sources: Sequence[PathLike]) -> list[GivenEpisode]:
    """The episodes of some sources."""
    files = episode_files([str(source) for source in sources])
    return [GivenEpisode(str(file), read_episode(file), file_hash(file)) for file in files]
