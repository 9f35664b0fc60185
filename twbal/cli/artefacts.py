"""Names and places of what stages hand to each other."""

import hashlib
import os
from collections.abc import Iterable, Sequence
from itertools import islice
from pathlib import Path

from omegaconf import DictConfig

from twbal.cli.console import say
from twbal.cli.manifest import MANIFEST, read_manifest
from twbal.cli.typed_config import recorded
from twbal.core.episode import Episode, Provenance
from twbal.core.errors import ConfigError, DataError, LogError
from twbal.core.files import file_hash
from twbal.core.robot_parameters import RobotParameters, parameter_hash
from twbal.io.logs import read_episode
from twbal.io.recorded_sheet import is_of_sheet, robot_in_words

MODEL, POLICY, PREDICTION = "model.pt", "policy.pt", "prediction.pt"
POLICY_ENDING = ".pt"  # of a file, by which it is told from a folder
DIAGNOSIS = "diagnosis.json"
DISTRIBUTION = "robot_distribution.pt"
_NAMED = 3  # folders of logs that are named one by one
_DEPTH, _LOOKED_AT = 5, 2000  # folders in which logs are looked for, where one has none itself
EVIDENCE, EVALUATION, COURSE = "evidence.json", "evaluation.json", "course.json"


def episode_file(folder: Path, trial: int) -> Path:
    """Where the episode of a trial is logged."""
    return folder / f"trial_{trial:03d}.mcap"


def paths_in(given: str | Sequence[str]) -> list[Path]:
    """One path, or several, as a setting names them."""
    return [Path(word) for word in ([given] if isinstance(given, str) else given)]


def episode_files(sources: str | Sequence[str]) -> list[Path]:
    """The logs that `episodes=...` names: source by source, and sorted by name within each.

    Args:
        sources: run folders, folders of logs, or logs.

    Raises:
        LogError: a source is not there, or has no log in it.
    """
    files = [path for source in paths_in(sources) for path in _logs_in(source)]
    if not files:
        raise LogError("No episodes were given. Give run folders, or folders of *.mcap files.")
    return files


def read_logs(folders: Iterable[Path]) -> tuple[Episode, ...]:
    """The episodes of run folders, in order."""
    return tuple(read_episode(file) for folder in folders for file in episode_files(str(folder)))


def episodes_of(files: Iterable[Path], robot: str) -> list[Episode]:
    """The episodes in logs of one robot.

    Args:
        files: the logs.
        robot: name of its sheet.

    Raises:
        DataError: a log is of another robot.
    """
    found = []
    for file in files:
        found.append(read_episode(file))
        provenance = found[-1].provenance
        if not is_of_sheet(provenance, robot):
            raise DataError(
                f"{file} is an episode of the robot {robot_in_words(provenance)}; expected is {robot!r}. Choose the "
                "sheet that the episodes were made with by robot=..., with the --config-dir=... in which it lies."
            )
    return found


def say_duplicates(files: Sequence[Path]) -> None:
    """Warn where logs are the same recording: it would count twice."""
    first: dict[str, Path] = {}
    for file in files:
        known = first.setdefault(file_hash(file), file)
        if known is not file:
            say(f"WARNING: {file} is the same recording as {known}: it counts twice, so results look too sure")


def _logs_in(source: Path) -> list[Path]:
    if source.is_file():
        return [source]
    inside = source / "episodes"
    try:
        made_by = read_manifest(source)
    except DataError as error:
        use = f"Give {inside} to use the logs as they are." if inside.is_dir() else "Without it the logs can be read."
        raise LogError(
            f"{source / MANIFEST} is no manifest of this version of twbal ({error.__cause__}) {use}"
        ) from error
    if made_by is not None and made_by.stage == "import-log" and not made_by.complete:
        raise LogError(f"{source} is not complete: twbal import-log was ended in its midst. Run that command again.")
    files = sorted(inside.glob("*.mcap")) or sorted(source.glob("*.mcap"))
    if not files:
        if any((source / "interrupted").glob("*.mcap")):
            raise LogError(
                f"{source} has only episodes that were broken off: give {source / 'interrupted'} to use them."
            )
        raise LogError(f"{source} {_without_logs(source)}")
    return files


def _without_logs(source: Path) -> str:
    """What is said of a source that has no logs, after its name."""
    advice = "Give the run folder of a stage that records episodes, or a folder of logs."
    if not source.is_dir():
        return f"is not there. {advice}"
    what = "has no episode logs (*.mcap), neither in itself nor in a folder episodes/ in it"
    below = _folders_of_logs(source)
    if not below:
        return f"{what}. {advice}"
    more = " and others" if len(below) > _NAMED else ""
    return f"{what}. Folders below it have: {', '.join(map(str, below[:_NAMED]))}{more}. Give those that are meant."


def _folders_of_logs(source: Path) -> list[Path]:
    """Folders below one that have logs, as they are given, in order; one more than are named, at most.

    Only so deep as the run folders of iterate lie below a folder of runs, and of an endless tree a part.
    """
    found: list[Path] = []
    for place, below, files in islice(os.walk(source), _LOOKED_AT):
        folder = Path(place)
        depth = len(folder.relative_to(source).parts)
        below[:] = sorted(name for name in below if depth < _DEPTH and not name.startswith((".", "interrupted")))
        if any(name.endswith(".mcap") for name in files):
            found.append(folder.parent if folder.name == "episodes" else folder)
        if len(found) > _NAMED:
            break
    return found


def agent_file(given: str | None) -> Path | None:
    """The policy that `trained_agent=` names, by itself or by the run folder of train-agent; None: of none.

    Raises:
        ConfigError: it is not there, or has another name than train-agent gives it.
    """
    if not given:
        return None
    path = Path(given).absolute()
    file = path if path.name == POLICY and not path.is_dir() else path / POLICY
    if not file.is_file():
        what = "is not there" if not path.exists() else f"has no {POLICY}" if path.is_dir() else f"is no {POLICY}"
        raise ConfigError(
            f"{given} of trained_agent=... {what}; expected is the run folder of `twbal train-agent`, or the {POLICY} "
            "in it."
        )
    return file


def policy_files(policy: DictConfig) -> list[Path]:
    """The checkpoint of a `policy` node; none where the policy is made without."""
    return [Path(policy.path)] if "path" in policy else []


def policy_hash(policy: DictConfig) -> str:
    """sha256 of the checkpoint of a `policy` node, or of its settings where the policy is made without.

    Raises:
        DataError: the checkpoint cannot be read.
    """
    files = policy_files(policy)
    return file_hash(files[0]) if files else hashlib.sha256(recorded(policy, ()).encode()).hexdigest()


def driven_robot(robot: RobotParameters, policy: DictConfig, seed: int, config: str) -> Provenance:
    """Where episodes of a real robot come from; their trials are numbered later.

    Args:
        robot: its sheet.
        policy: configuration of the policy that drives it.
        seed: of the stage.
        config: what is recorded of the stage's configuration.
    """
    sheet, driver = parameter_hash(robot), policy_hash(policy)
    return Provenance(robot.name, "robot", parameter_hash=sheet, policy_hash=driver, seed=seed, config=config)


def hashes(files: Iterable[Path]) -> list[str]:
    """sha256 of each file."""
    return [file_hash(file) for file in files]
