"""Put runs of Algorithm 1, and sweeps of them, beside each other."""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from omegaconf import DictConfig, ListConfig

from twbal.algorithm.comparison import Run, latex, rows, run_values
from twbal.algorithm.summary import read_summary
from twbal.cli.console import run_folder
from twbal.cli.typed_config import typed
from twbal.cli.yaml_data import Bounds, read_yaml
from twbal.core.errors import ConfigError, DataError
from twbal.core.files import write_atomically
from twbal.viz.canvas import svg
from twbal.viz.comparison_figure import comparison_figure
from twbal.viz.page import inline, render

SUMMARY = "summary.json"


@dataclass(frozen=True)
class Settings:
    """See conf/compare.yaml."""

    seed: int


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder."""
    out, settings = run_folder(), typed(Settings, cfg)
    folders = _folders(cfg.runs)
    groups = {name: _runs(folder) for name, folder in folders.items()}
    table = rows(groups, settings.seed)
    names = list(dict.fromkeys(key for row in table for key in row))
    figure = comparison_figure(groups)
    drawn = svg(figure)
    write_atomically(out / "comparison.svg", drawn)
    picture = inline(drawn, "comparison", "Every metric of every run, by group")
    page = render("comparison.html.jinja", groups=groups, rows=table, names=names, picture=picture)
    write_atomically(out / "comparison.html", page)
    write_atomically(out / "table.csv", _csv(names, table))
    write_atomically(out / "runs.csv", _csv(["group", "key", *_metrics(groups)], _each(groups)))
    write_atomically(out / "table.tex", latex(table))
    for name in names:
        print(f"{name:58}", *(f"{row.get(name, ''):>28}" for row in table))
    for file in ("comparison.html", "comparison.svg", "table.csv", "runs.csv", "table.tex"):
        print(f"made  {out / file}")


def _folders(given: ListConfig | DictConfig | str) -> dict[str, Path]:
    """Folders by the name of their group."""
    if isinstance(given, DictConfig):
        found = {str(name): Path(str(folder)) for name, folder in given.items()}
    else:
        words = [given] if isinstance(given, str) else list(given)
        found = {Path(word).name: Path(word) for word in words}
        if len(found) < len(words):
            raise ConfigError("Two of the folders have the same name: give groups names by runs={a:folder,b:folder}.")
    if not found:
        raise ConfigError("No runs were given. Give folders of `twbal iterate`, or of sweeps of it, by runs=[a,b].")
    return found


def _runs(folder: Path) -> list[Run]:
    """All runs below a folder.

    Raises:
        DataError: there is none, or one cannot be read.
    """
    files = sorted(folder.rglob(SUMMARY))
    if not files:
        what = "has no run of `twbal iterate` in it (no summary.json)" if folder.is_dir() else "is not there"
        raise DataError(f"{folder} {what}. Give a run folder, or the folder of a sweep.")
    return [_run(file) for file in files]


def _run(file: Path) -> Run:
    summary = read_summary(file)
    return Run((summary.robot, str(summary.seed), _link_seed(file.parent)), run_values(summary))


def _link_seed(run: Path) -> str:
    """The seed of a run's virtual robot, as its configuration says it; "None" where it says none."""
    try:
        settings = read_yaml(run / ".hydra" / "config.yaml", Bounds(2**20, 32, 20_000))
        return str(settings["link"]["seed"])
    except (FileNotFoundError, KeyError, TypeError):
        return "None"


def _metrics(groups: Mapping[str, Sequence[Run]]) -> list[str]:
    return list(next(iter(groups.values()))[0].values)


def _each(groups: Mapping[str, Sequence[Run]]) -> list[dict[str, str]]:
    """One row a run."""
    return [
        {"group": name, "key": " ".join(run.key), **{metric: repr(value) for metric, value in run.values.items()}}
        for name, runs in groups.items()
        for run in runs
    ]


def _csv(names: Sequence[str], table: Sequence[Mapping[str, str]]) -> str:
    page = io.StringIO()
    writer = csv.DictWriter(page, names, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(table)
    return page.getvalue()
