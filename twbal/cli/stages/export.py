"""Episodes as tables that any other program reads: CSV or Parquet."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas
from omegaconf import DictConfig

from twbal.cli.artefacts import episode_files
from twbal.cli.console import print_result, run_folder
from twbal.cli.manifest import Manifest, StageWork, perform
from twbal.cli.typed_config import recorded
from twbal.core.episode import Episode
from twbal.core.errors import ConfigError, install_advice
from twbal.core.files import replacing, unused
from twbal.core.heading import HeadingSample
from twbal.core.motion_profile import Motion
from twbal.core.plant import Observation, Pose
from twbal.io.logs import read_episode

NOT_RECORDED = ("episodes",)


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder."""
    out = run_folder()
    manifest = run(cfg, out)
    print_result(manifest, out, f"read {out / manifest.outputs[0].path} by any program")


def run(cfg: DictConfig, out: Path) -> Manifest:
    """Write the episodes that `cfg` names as tables into `out`, unless that is done there already."""
    files = episode_files(cfg.episodes)
    step = StageWork("export", out, recorded(cfg, NOT_RECORDED), {"episodes": files}, 0)
    return perform(step, lambda: _export(files, str(cfg.format), out))


def table(episode: Episode) -> pandas.DataFrame:
    """A row for each control instant: observations, the command that follows (empty in the last), and the state.

    Channels of the observations that no sensor measured end in `_estimated`; those of the state begin with `state_`,
    and those of true poses and of a reference, where there are some, with `pose_` and `reference_`.
    """
    estimated = {e.channel for e in episode.estimated}
    columns = {
        f"{name}_estimated" if name in estimated else name: episode.observations[:, i]
        for i, name in enumerate(Observation._fields)
    }
    columns["command"] = np.append(episode.commands, np.nan)
    columns.update({f"state_{name}": episode.states[:, i] for i, name in enumerate(episode.channels)})
    if episode.poses is not None:
        columns.update({f"pose_{name}": episode.poses[:, i] for i, name in enumerate(Pose._fields)})
    if episode.references is not None:
        columns.update({f"reference_{name}": episode.references[:, i] for i, name in enumerate(Motion._fields)})
    if episode.headings is not None:
        columns.update({f"heading_{name}": episode.headings[:, i] for i, name in enumerate(HeadingSample._fields)})
    return pandas.DataFrame(columns)


def _export(files: Sequence[Path], kind: str, out: Path) -> list[Path]:
    made, names = list[Path](), list[str]()
    for number, file in enumerate(files):
        same_name = [other for other in files if other.stem == file.stem]
        names.append(unused(file.stem if len(same_name) == 1 else f"{file.stem}_{number}", names))
        made.append(out / f"{names[-1]}.{kind}")
        _WRITERS[kind](table(read_episode(file)), made[-1])
    return made


def _write_csv(rows: pandas.DataFrame, path: Path) -> None:
    with replacing(path) as stream:
        rows.to_csv(stream, index=False)


def _write_parquet(rows: pandas.DataFrame, path: Path) -> None:
    try:
        import pyarrow  # noqa: F401
    except ImportError as error:
        raise ConfigError(f"Parquet needs pyarrow: {install_advice('viewers')}; or give format=csv.") from error
    with replacing(path) as stream:
        rows.to_parquet(stream, engine="pyarrow", index=False)


_WRITERS: Mapping[str, Callable[[pandas.DataFrame, Path], None]] = {"csv": _write_csv, "parquet": _write_parquet}
