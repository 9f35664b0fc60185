"""Bring logs that twbal did not make into episode logs."""

import json
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import count
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from hydra import compose
from hydra.core.global_hydra import GlobalHydra
from hydra.core.hydra_config import HydraConfig
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf, open_dict

from twbal.cli.artefacts import paths_in
from twbal.cli.commands import text
from twbal.cli.console import (
    add_override,
    configuration_flags,
    next_command,
    overridden,
    print_result,
    run_folder,
    say,
    with_progress,
)
from twbal.cli.imported_before import imported_before
from twbal.cli.log_files import check_log_file
from twbal.cli.manifest import Manifest, StageWork, perform
from twbal.cli.recorded_period import KEY
from twbal.cli.typed_config import recorded, typed
from twbal.core.channels import Channels
from twbal.core.episode import Episode, Provenance
from twbal.core.errors import ConfigError, DataError, LogError
from twbal.core.files import file_hash, unused, write_atomically
from twbal.core.robot_parameters import RobotParameters, parameter_hash
from twbal.core.text import counted
from twbal.io.importers.checks.doubt import Doubt
from twbal.io.importers.conversion import Imported, Wanted, import_file
from twbal.io.importers.duplicates import duplicated
from twbal.io.importers.guess import Guess, guess
from twbal.io.importers.guesses import Alike, alike
from twbal.io.importers.mapping import ACCELEROMETER, Mapping
from twbal.io.importers.remaining_entries import KnownMapping
from twbal.io.importers.tilt_by_gyro import FILTER_TIME
from twbal.io.logs import read_episode
from twbal.io.logs.writer import write_episode
from twbal.sysid.recording import SAME_PERIOD
from twbal.viz.canvas import save
from twbal.viz.doubt_figure import doubt_figure
from twbal.viz.episode_figures import courses_figure

NOT_RECORDED = ("files", "guess")
MAPPING, EPISODES, NOT_IMPORTED, DOUBTS = "my_log.yaml", "episodes", "not_imported.txt", "doubts"
_DRAWN = 12  # episodes


@dataclass(frozen=True)
class Settings:
    """See conf/import_log.yaml."""

    period: float | None
    min_length: int


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder."""
    out = run_folder()
    if not (overridden("robot") or overridden("robot.name")):
        say(f"the logs are taken for those of robot {cfg.robot.name}, as no robot=... is given")
    if cfg.guess:
        propose(paths_in(cfg.files), out, instantiate(cfg.robot), _known_mapping())
        return
    manifest = run(cfg, out)
    logs = [out / made.path for made in manifest.outputs if PurePosixPath(made.path).parent.name == EPISODES]
    print_result(manifest, out, _diagnosis_of(out, read_episode(logs[0]).control_period, cfg))
    left_out = out / NOT_IMPORTED
    if any(out / made.path == left_out for made in manifest.outputs):
        raise LogError(
            f"{len(left_out.read_text().splitlines())} of {len(paths_in(cfg.files))} files were not imported; "
            f"{left_out} says why. The others were, and can be used."
        )


def run(cfg: DictConfig, out: Path) -> Manifest:
    """Import the files that `cfg` names into `out`/episodes, unless that is done there already.

    Raises:
        LogError: none of the files can be imported.
    """
    settings = typed(Settings, cfg)
    files, unreadable = _readable(paths_in(cfg.files))
    if not files:
        raise LogError(unreadable[0] if len(unreadable) == 1 else _none_of(unreadable, len(unreadable)))
    robot: RobotParameters = instantiate(cfg.robot)
    mapping: Mapping = _mapping(cfg["import"])
    config = recorded(cfg, NOT_RECORDED)
    provenance = Provenance(robot.name, "robot", parameter_hash=parameter_hash(robot), config=config)
    wanted = Wanted(partial(_channels_at, cfg), settings.period, settings.min_length, robot)
    step = StageWork("import-log", out, config, {"files": files}, 0)
    manifest = perform(step, lambda: _import_to_files(files, unreadable, mapping, wanted, provenance, out))
    for before in imported_before(manifest, out):
        print(f"  {'' if before.is_expected else 'WARNING: '}{before.sentence}")
    return manifest


def _channels_at(cfg: DictConfig, period: float) -> Channels:
    """The state of a robot that has the control period of a log [s], whatever its sheet says."""
    if abs(period - cfg.robot.control_period) > SAME_PERIOD:
        of_log = cfg.copy()
        with open_dict(of_log):
            of_log.robot.control_period = period
        cfg = of_log
    channels: Channels = instantiate(cfg.state)
    return channels


def _mapping(cfg: DictConfig) -> Mapping:
    open_ones = sorted(OmegaConf.missing_keys(cfg))
    if open_ones:
        chosen = f" import={HydraConfig.get().runtime.choices['import']}" if HydraConfig.initialized() else ""
        raise ConfigError(f"The mapping{chosen} has ??? for {', '.join(open_ones)}: fill these in, or write null.")
    if "_target_" not in cfg:
        raise ConfigError(
            "The mapping lacks its first entry. Add `_target_: twbal.io.importers.mapping.mapping`, or have one "
            "proposed by `twbal import-log guess=true`."
        )
    made: Mapping = instantiate(cfg, _convert_="all")
    return made


def _diagnosis_of(out: Path, period: float, cfg: DictConfig) -> str:
    """The command that diagnoses what was imported: with the simulation of its robot, at the period of its logs.

    A tilt that the import has worked out by a filter is that of a simulation with this filter.
    """
    sheet = float(cfg.robot.control_period)
    if abs(period - sheet) > SAME_PERIOD:
        say(f"the logs have a control period of {period:.6g} s; the sheet of robot {cfg.robot.name} says {sheet:.6g} s")
        add_override(f"{KEY}={period!r}")
    command = next_command("diagnose", {"episodes": out, "diagnosis": "real_logs"}, "robot", "sim")
    quantities = cfg["import"].quantities
    if quantities.get("tilt") is None and quantities.get(ACCELEROMETER[0]) is not None:
        of_filter = f"sim.effects.tilt_filter.rate={1.0 / FILTER_TIME:g} sim.effects.tilt_filter.lead=0"
        command += f" +effect@sim.effects.tilt_filter=tilt_filter {of_filter}"
    return command


def _known_mapping() -> KnownMapping | None:
    """The mapping that has the name of the robot that was chosen; None where there is none."""
    robot = HydraConfig.get().runtime.choices["robot"]
    if robot not in GlobalHydra.instance().config_loader().get_group_options("import"):
        return None
    entries = OmegaConf.to_container(compose("import_log", [f"import={robot}"])["import"])
    return (
        KnownMapping(robot, {str(key): entry for key, entry in entries.items()}) if isinstance(entries, dict) else None
    )


def propose(files: Sequence[Path], out: Path, robot: RobotParameters, known: KnownMapping | None = None) -> None:
    """Print what files look like, and write a mapping to fill in; one for each kind of file, where they differ.

    Args:
        files: to look at.
        out: folder for the mappings.
        robot: whose torque limit makes a torque of a duty cycle.
        known: the mapping of that robot; None where there is none.

    Raises:
        DataError: a file cannot be read; the mappings of the others are written.
    """
    found: list[tuple[Path, Guess]] = []
    unread: list[Path] = []
    for file in files:
        try:
            check_log_file(file)
            found.append((file, guess(file, robot, known)))
        except DataError as error:
            if len(files) == 1 or (not found and file is files[-1]):
                raise
            print(f"  WARNING: not looked at: {_naming(file, error)}")
            unread.append(file)
    groups = alike(found)
    for group, name in zip(groups, _free_names(), strict=False):
        _propose(group, out, name)
    if len(groups) > 1:
        print(f"these files need {len(groups)} mappings: import them by {len(groups)} calls")
    if unread:
        names = ", ".join(map(str, unread))
        raise DataError(f"{len(unread)} of {len(files)} files cannot be read, as said above: {names}")


def _free_names() -> Iterator[str]:
    """Names of files for mappings, which no other choice of the group has: that would be found in their place."""
    taken = GlobalHydra.instance().config_loader().get_group_options("import") if GlobalHydra().is_initialized() else []
    for number in count(1):
        name = MAPPING if number == 1 else MAPPING.replace(".yaml", f"_{number}.yaml")
        if Path(name).stem not in taken:
            yield name


def _propose(group: Alike, out: Path, name: str) -> None:
    """Print and write the mapping of files that share it."""
    first, found = group.files[0], group.guess
    print("\n".join([f"{first}:", *found.table, ""]))
    if len(group.files) > 1:
        print(f"the same mapping fits {', '.join(map(str, group.files[1:]))}\n")
    print(found.mapping)
    for sentence in group.differs:
        print(f"differs: {sentence}")
    write_atomically(out / "import" / name, found.mapping)
    if found.open:
        print(f"fill in (???): {'; '.join(found.open)}")
    if found.is_duty:
        print("or, without the data of a motor: take the command from the torque_limit, as the mapping's comments say")
    if found.unknown_units:
        print(f"check the units of: {', '.join(found.unknown_units)}")
    print(f"made  {out / 'import' / name}")
    given = first if len(group.files) == 1 else list(map(str, group.files))
    command = next_command("import-log", {"import": Path(name).stem, "files": given}, "robot")
    print(f"next  look through it, then: {command} {shlex.quote(_found_in(out))}")


def _found_in(out: Path) -> str:
    """The word by which the mapping in a run folder is found, beside a person's own folder where there is one."""
    if any(flag.startswith("--config-dir") for flag in configuration_flags()):
        return f"hydra.searchpath={text([f'file://{out.absolute()}'])}"  # Hydra takes one --config-dir, and no %20
    return f"--config-dir={out}"


def _readable(files: Sequence[Path]) -> tuple[list[Path], list[str]]:
    """The files that can be opened, and a sentence on each of the others."""
    readable, refused = [], []
    for file in files:
        try:
            check_log_file(file)
            if file.suffix == ".mcap":
                raise LogError(
                    f"{file} is an MCAP file. Logs of twbal's need no import; other ones: export them as CSV."
                )
            file_hash(file)
        except DataError as error:
            refused.append(_naming(file, error))
        else:
            readable.append(file)
    return readable, refused


def _naming(file: Path, error: DataError) -> str:
    return str(error) if str(file) in str(error) else f"{file}: {error}"


def _names(files: Sequence[Path]) -> list[str]:
    """A name for each file's recordings: its own, with that of its folder or a number where others have the same."""
    stems = [file.stem for file in files]
    parents = [
        stem if stems.count(stem) == 1 else f"{file.parent.name}_{stem}"
        for file, stem in zip(files, stems, strict=True)
    ]
    return [
        name if parents.count(name) == 1 else f"{name}_{parents[:k].count(name) + 1}" for k, name in enumerate(parents)
    ]


def _none_of(refused: Sequence[str], count: int) -> str:
    return f"None of {count} files can be imported. The first, {refused[0]}"


class _Import(NamedTuple):
    """What came out of all files: recordings with their names, what was refused, pictures of doubts."""

    episodes: list[Episode]
    names: list[str]
    refused: list[str]
    pictures: list[tuple[str, Doubt]]


def _import_to_files(
    files: Sequence[Path],
    unreadable: Sequence[str],
    mapping: Mapping,
    wanted: Wanted,
    provenance: Provenance,
    out: Path,
) -> list[Path]:
    """Import what can be; what cannot is listed in `not_imported.txt`.

    Raises:
        LogError: none of the files can be imported.
    """
    for sentence in unreadable:
        print(f"  WARNING: not imported: {sentence}")
    found = _imported(files, mapping, wanted, provenance)
    refused = [*unreadable, *found.refused]
    if not found.episodes:
        count = len(files) + len(unreadable)
        raise LogError(refused[0] if count == 1 else _none_of(refused, count))
    for sentence in (*duplicated(found.episodes, found.names), *_periods(found.episodes, found.names)):
        print(f"  WARNING: {sentence}")
    made: list[Path] = []
    if refused:
        made.append(out / NOT_IMPORTED)
        write_atomically(made[-1], "\n".join(refused) + "\n")
    for name, episode in zip(found.names, found.episodes, strict=True):
        made.append(out / EPISODES / f"{name}.mcap")
        write_episode(made[-1], episode, partial(_shown, name))
    for name, episode in list(zip(found.names, found.episodes, strict=True))[:_DRAWN]:
        made.append(out / "figures" / f"{name}.png")
        save(courses_figure(episode, name), made[-1], dots_per_inch=90)
    for name, doubt in found.pictures[:_DRAWN]:
        if doubt.evidence is not None:
            made.append(out / DOUBTS / f"{name}.png")
            save(doubt_figure(doubt.sentence, doubt.evidence), made[-1], dots_per_inch=90)
    return made


def _imported(files: Sequence[Path], mapping: Mapping, wanted: Wanted, provenance: Provenance) -> _Import:
    """What can be imported of the files, and a sentence on each of the others."""
    found = _Import([], [], [], [])
    names = _names(files)
    for file, name in zip(with_progress(files, "files", len(files)), names, strict=True):
        try:
            its_own = f"{provenance.config}imported_from: {json.dumps(name, ensure_ascii=False)}\n"  # a run of its own
            imported = import_file(
                file, mapping, wanted, replace(provenance, trial=len(found.episodes), config=its_own)
            )
        except DataError as error:
            found.refused.append(_naming(file, error))
            if len(files) > 1:
                print(f"  WARNING: not imported: {found.refused[-1]}")
            continue
        _tell(file, imported)
        whole = len(imported.episodes) == 1
        for k in range(len(imported.episodes)):  # a part of one file may be called as another file
            found.names.append(unused(name if whole else f"{name}_{k}", found.names))
        found.episodes.extend(imported.episodes)
        drawn = [picture for picture, _ in found.pictures]
        for k, doubt in enumerate(imported.doubts, start=1):
            drawn.append(unused(f"{name}_{k}", drawn))
            found.pictures.append((drawn[-1], doubt))
    return found


def _shown(name: str, chunks: Sequence[int]) -> Iterator[int]:
    """The chunks of a log that is written, with lines of progress where it takes long."""
    return with_progress(chunks, f"chunks of {name} written", len(chunks))


def _periods(episodes: Sequence[Episode], names: Sequence[str]) -> Iterator[str]:
    """A sentence on recordings of more than one control period, which no later stage takes together."""
    by_period = {episode.control_period: name for episode, name in zip(episodes, names, strict=True)}
    if max(by_period) - min(by_period) > SAME_PERIOD:
        periods = ", ".join(f"{name} {period:.6g} s" for period, name in sorted(by_period.items()))
        yield f"control periods differ ({periods}): import them one by one, or give a period=... that suits all"


def _tell(file: Path, imported: Imported) -> None:
    periods = sum(map(len, imported.episodes))
    period = imported.episodes[0].control_period
    recordings = counted(len(imported.episodes), "recording")
    print(f"{file}: {recordings}, {periods * period:.3g} s at {1 / period:.4g} Hz")
    for sentence in imported.notes:
        print(f"  {sentence}")
    for doubt in imported.doubts:
        print(f"  WARNING: {doubt.sentence}")
    for sentence in imported.untold:
        print(f"  this log does not tell {sentence}")
