"""How every stage begins and ends on the command line: its run folder, what it made there, and what comes next."""

import re
import shlex
from collections import Counter
from pathlib import Path, PurePosixPath

from hydra.core.hydra_config import HydraConfig

from twbal.configuration import conf_folder
from twbal.stages.manifest import Manifest

LISTED = 3  # files of one folder that are named one by one


def run_folder() -> Path:
    """Hydra's folder for this run, relative to the working directory where it lies in it."""
    folder = Path(HydraConfig.get().runtime.output_dir)
    return folder.relative_to(Path.cwd()) if folder.is_relative_to(Path.cwd()) else folder


def configuration_flags() -> list[str]:
    """The flags by which this run was given configuration of the user's own."""
    sources = [(source.provider, source.path) for source in HydraConfig.get().runtime.config_sources]
    replaced = [f"--config-path={path}" for who, path in sources if who == "main" and Path(path) != conf_folder()]
    added = [f"--config-dir={path}" for who, path in sources if who == "command-line"]
    return replaced + added


def told_of(*groups: str) -> str:
    """The words by which this run was told of `groups` (such as robot, state), for a next command to have them too."""
    words = HydraConfig.get().overrides.task
    return "".join(f" {shlex.quote(word)}" for word in words if re.match(rf"[+~]*({'|'.join(groups)})\b", word))


def closing(manifest: Manifest, out: Path, following: str) -> None:
    """Print what a stage made and the command that would come next."""
    folders = Counter(PurePosixPath(made.path).parent for made in manifest.outputs)
    for folder, count in folders.items():
        if count > LISTED:
            print(f"made  {out / folder}/ ({count} files)")
    for made in manifest.outputs:
        if folders[PurePosixPath(made.path).parent] <= LISTED:
            print(f"made  {out / made.path}")
    print(f"next  {following}")
