"""Save what is left of damaged episode logs."""

from collections.abc import Sequence
from pathlib import Path

from omegaconf import DictConfig

from twbal.cli.artefacts import paths_in
from twbal.cli.console import next_command, print_result, run_folder
from twbal.cli.manifest import Manifest, StageWork, perform
from twbal.cli.typed_config import recorded
from twbal.core.errors import LogError
from twbal.core.files import unused, write_atomically
from twbal.io.logs import recover_episode, write_episode

NOT_SAVED = "not_saved.txt"


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder."""
    out = run_folder()
    manifest = run(cfg, out)
    lost = out / NOT_SAVED
    shown = {"episode": out / manifest.outputs[0].path, "simulate": False, "film": False}  # of any robot
    print_result(manifest, out, next_command("plot", shown))
    if any(out / made.path == lost for made in manifest.outputs):
        raise LogError(
            f"Nothing could be saved of {len(lost.read_text(encoding='utf-8').splitlines())} logs; {lost} says why. "
            "What could be saved of the others was."
        )


def run(cfg: DictConfig, out: Path) -> Manifest:
    """Save what is left of the logs that `cfg` names into `out`/episodes, unless that is done there already."""
    files = _logs(cfg.logs)
    step = StageWork("repair", out, recorded(cfg, ("logs",)), {"logs": files}, 0)
    return perform(step, lambda: _recover(files, out))


def _logs(given: str | Sequence[str]) -> list[Path]:
    """The logs, and those in the folders; unfinished ones that a killed process left are looked for too."""
    found: list[Path] = []
    for path in paths_in(given):
        inside = sorted([*path.rglob("*.mcap"), *path.rglob(".*.mcap.*.partial")]) if path.is_dir() else [path]
        found.extend(inside)
    if not found:
        raise LogError(f"There are no logs (*.mcap) in {given}.")
    return found


def _recover(files: Sequence[Path], out: Path) -> list[Path]:
    made, hopeless, names = list[Path](), list[str](), list[str]()
    for file in files:
        try:
            found = recover_episode(file)
        except LogError as error:
            hopeless.append(str(error))
            print(error)
            continue
        names.append(unused(file.name.removeprefix(".").split(".mcap")[0], names))
        made.append(out / "episodes" / f"{names[-1]}.mcap")
        write_episode(made[-1], found.episode)
        kept = len(found.episode) + 1
        state = f"{found.damage}; {kept} samples saved, {found.lost_samples} lost" if found.damage else "is whole"
        print(f"{file}: {state}")
    if not made:
        raise LogError(f"Nothing can be saved of {len(hopeless)} logs. The last one: {hopeless[-1]}")
    if hopeless:
        write_atomically(out / NOT_SAVED, "".join(" ".join(said.split()) + "\n" for said in hopeless))
        made.append(out / NOT_SAVED)
    return made
