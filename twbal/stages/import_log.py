"""Bring logs that twbal did not make into episode logs."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig
from tqdm import tqdm

from twbal.episode import Episode, Provenance
from twbal.errors import ConfigError, LogError
from twbal.figures.canvas import save
from twbal.figures.courses import courses_figure
from twbal.files import write_atomically
from twbal.foreign.episodes import Imported, Wanted, duplicated, import_file
from twbal.foreign.guess import guess
from twbal.foreign.mapping import Mapping
from twbal.logs.writer import write_episode
from twbal.robot.parameters import RobotParameters, parameter_hash
from twbal.stages.closing import closing, run_folder, told_of
from twbal.stages.manifest import Manifest, Step, perform
from twbal.stages.settings import at_least, recorded, typed

NOT_RECORDED = ("files", "guess")
MAPPING = "my_log.yaml"
_DRAWN = 12  # episodes


@dataclass(frozen=True)
class Settings:
    """See conf/stage/import_log.yaml."""

    period: float | None
    shortest: int


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder."""
    out = run_folder()
    if cfg.guess:
        propose(_files(cfg.files), out)
        return
    manifest = run(cfg, out)
    closing(manifest, out, f"twbal diagnose episodes={out}{told_of('robot')}")


def run(cfg: DictConfig, out: Path) -> Manifest:
    """Import the files that `cfg` names into `out`/episodes, unless that is done there already."""
    settings = typed(Settings, cfg)
    at_least(4, shortest=settings.shortest)
    files = _files(cfg.files)
    robot: RobotParameters = instantiate(cfg.robot)
    mapping: Mapping = instantiate(cfg["import"], _convert_="all")
    text = recorded(cfg, NOT_RECORDED)
    provenance = Provenance(robot.name, "robot", parameter_hash=parameter_hash(robot), config=text)
    wanted = Wanted(instantiate(cfg.state), settings.period, settings.shortest)
    step = Step("import-log", out, text, {"files": files}, 0)
    return perform(step, lambda: _import_to_files(files, mapping, wanted, provenance, out))


def propose(files: Sequence[Path], out: Path) -> None:
    """Print what the first file looks like and write a mapping for it to fill in."""
    found = guess(files[0])
    print("\n".join([f"{files[0]}:", *found.table, "", found.mapping]))
    write_atomically(out / "import" / MAPPING, found.mapping)
    if found.missing:
        print(f"not found: {', '.join(found.missing)}")
    print(f"made  {out / 'import' / MAPPING}")
    command = ["twbal", "import-log", f"--config-dir={out}", f"import={Path(MAPPING).stem}", f"files={files[0]}"]
    print(f"next  look through it, then: {shlex.join(command)}{told_of('robot')}")


def _files(given: str | Sequence[str]) -> list[Path]:
    files = [Path(word) for word in ([given] if isinstance(given, str) else given)]
    if not files:
        raise LogError("No files were given. Give logs by files=log.csv, or files=[a.csv,b.csv].")
    for file in files:
        if file.suffix == ".mcap":
            raise LogError(f"{file} is an MCAP file. Logs of twbal's need no import; other ones: export them as CSV.")
    stems = [file.stem for file in files]
    if len(set(stems)) < len(stems):
        raise ConfigError(f"Two of the files have the same name: {', '.join(sorted(stems))}. Import them one by one.")
    return files


def _import_to_files(
    files: Sequence[Path], mapping: Mapping, wanted: Wanted, provenance: Provenance, out: Path
) -> list[Path]:
    made: list[Path] = []
    episodes: list[Episode] = []
    names: list[str] = []
    for file in tqdm(files, "files", disable=None if len(files) > 1 else True):
        source = replace(provenance, trial=len(episodes))
        imported = import_file(file, mapping, wanted, source)
        _tell(file, imported)
        for k, episode in enumerate(imported.episodes):
            names.append(file.stem if len(imported.episodes) == 1 else f"{file.stem}_{k}")
            episodes.append(episode)
            made.append(out / "episodes" / f"{names[-1]}.mcap")
            write_episode(made[-1], episode)
    for sentence in duplicated(episodes, names):
        print(f"  WARNING: {sentence}")
    for name, episode in list(zip(names, episodes, strict=True))[:_DRAWN]:
        made.append(out / "figures" / f"{name}.png")
        save(courses_figure(episode, name), made[-1], dots_per_inch=90)
    return made


def _tell(file: Path, imported: Imported) -> None:
    periods = sum(map(len, imported.episodes))
    period = imported.episodes[0].control_period
    print(f"{file}: {len(imported.episodes)} recordings, {periods * period:.3g} s at {1 / period:.4g} Hz")
    for sentence in imported.notes:
        print(f"  {sentence}")
    for sentence in imported.doubts:
        print(f"  WARNING: {sentence}")
