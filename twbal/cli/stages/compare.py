"""Put runs of Algorithm 1, and sweeps of them, beside each other."""

import csv
import io
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from omegaconf import DictConfig, ListConfig

from twbal.algorithm.comparison import Run, latex, rows, run_values, without_pairs
from twbal.algorithm.summary import read_summary
from twbal.cli.artefacts import POLICY_ENDING
from twbal.cli.console import run_folder
from twbal.cli.manifest import MANIFEST, StageWork, perform_anew, read_manifest
from twbal.cli.typed_config import recorded, typed
from twbal.cli.yaml_data import OF_A_RUN, read_yaml, yaml_of
from twbal.core.errors import ConfigError, DataError
from twbal.core.files import write_atomically
from twbal.viz.canvas import svg
from twbal.viz.comparison_figure import comparison_figure
from twbal.viz.page import inline, render

SUMMARY = "summary.json"
_JUDGED_BY = {"success": ("rule of success", "successes"), "cost": ("cost function", "costs")}


@dataclass(frozen=True)
class Settings:
    """See conf/compare.yaml."""

    seed: int
    robustness: bool


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder."""
    out, settings = run_folder(), typed(Settings, cfg)
    folders = _folders(cfg.runs)
    files = [path for path in folders.values() if path.suffix == POLICY_ENDING]
    if files and not settings.robustness:
        raise ConfigError(f"{files[0]} is a policy; policies alone are compared by robustness=true.")
    summaries = {name: [path] if path in files else _summaries(path) for name, path in folders.items()}
    tested = None
    if settings.robustness:  # found before anything is drawn, so that what is wrong with them is said at once
        from twbal.cli.robustness_stage import compare_robustness, tested_policies  # here, as it loads MuJoCo

        groups = {name: [each if each in files else each.parent for each in found] for name, found in summaries.items()}
        tested = tested_policies(cfg, groups)
    if not files:
        for doubt in _judged_otherwise([file for found in summaries.values() for file in found]):
            print(f"WARNING: {doubt}")

    def make() -> list[Path]:
        groups = {} if files else {name: list(map(_run, found)) for name, found in summaries.items()}
        made = _compare_runs(groups, out, settings) if groups else []
        return made if tested is None else [*made, *compare_robustness(cfg, tested, out)]

    step = StageWork("compare", out, recorded(cfg, ()), {}, settings.seed)
    made = [out / output.path for output in perform_anew(step, make).outputs]
    for file in made:
        print(f"made  {file}")
    pages = [str(file) for file in made if file.suffix == ".html"]
    print(f"next  look at {' and '.join(pages)}")


def _compare_runs(groups: Mapping[str, Sequence[Run]], out: Path, settings: Settings) -> list[Path]:
    """Print and write tables, figure and page of what runs came to."""
    table = rows(groups)
    names = list(dict.fromkeys(key for row in table for key in row))
    figure = comparison_figure(groups)
    drawn = svg(figure)
    write_atomically(out / "comparison.svg", drawn)
    picture = inline(drawn, "comparison", "Every metric of every run, by group")
    page = render("comparison.html.jinja", groups=groups, rows=table, names=names, picture=picture)
    write_atomically(out / "comparison.html", page)
    write_atomically(out / "table.csv", _csv(names, table))
    each = [
        {"group": name, "key": " ".join(run.key), **{metric: repr(value) for metric, value in run.values.items()}}
        for name, runs in groups.items()
        for run in runs
    ]
    write_atomically(out / "runs.csv", _csv(list(each[0]), each))
    write_atomically(out / "table.tex", latex(table))
    for line in _columns(names, table):
        print(line)
    for name in without_pairs(groups):
        print(f"no run of {name} has robot and seeds of one of {next(iter(groups))}: better, worse, p are -")
    return [out / name for name in ("comparison.html", "comparison.svg", "table.csv", "runs.csv", "table.tex")]


def _columns(names: Sequence[str], table: Sequence[Mapping[str, str]]) -> Iterator[str]:
    """A line for each figure, a column for each group as wide as its words."""
    widest = max(map(len, names))
    widths = [max(len(row.get(name, "")) for name in names) for row in table]
    for name in names:
        cells = (f"{row.get(name, ''):>{width}}" for row, width in zip(table, widths, strict=True))
        yield "  ".join([f"{name:{widest}}", *cells]).rstrip()


def _folders(given: ListConfig | DictConfig | str) -> dict[str, Path]:
    """Folders by the name of their group."""
    if isinstance(given, DictConfig):
        found = {str(name): Path(str(folder)) for name, folder in given.items()}
    else:
        words = [given] if isinstance(given, str) else list(given)
        found = {Path(word).name: Path(word) for word in words}
        if len(found) < len(words):
            raise ConfigError("Two of the folders have the same name: give groups names by 'runs={a:folder,b:folder}'.")
    if not found:
        raise ConfigError("No runs were given. Give folders of `twbal iterate`, or of sweeps of it, by runs=[a,b].")
    return found


def _summaries(folder: Path) -> list[Path]:
    """Those of all runs below a folder.

    Raises:
        DataError: there is none.
    """
    files = sorted(folder.rglob(SUMMARY))
    if not files:
        what = "has no run of `twbal iterate` in it (no summary.json)" if folder.is_dir() else "is no folder"
        raise DataError(
            f"{folder} {what if folder.exists() else 'is not there'}. Give a run folder, or the folder of a sweep."
        )
    return files


def _run(file: Path) -> Run:
    summary = read_summary(file)
    return Run((summary.robot, str(summary.seed), _link_seed(file.parent)), run_values(summary))


def _settings(run: Path) -> Any:
    """A run's configuration, as its yaml holds it; {} where there is none.

    A copy of a run may be without hidden files, and so without Hydra's. Then the run's manifest is asked.
    """
    try:
        return read_yaml(run / ".hydra" / "config.yaml", OF_A_RUN)
    except FileNotFoundError:
        manifest = read_manifest(run)
        return {} if manifest is None else yaml_of(manifest.settings, run / MANIFEST, OF_A_RUN)


def _link_seed(run: Path) -> str:
    """The seed of a run's virtual robot, as its configuration says it; "None" where it says none."""
    try:
        return str(_settings(run)["link"]["seed"])
    except (KeyError, TypeError):
        return "None"


def _judged_otherwise(files: Sequence[Path]) -> Iterator[str]:
    """What is not comparable between runs, by their summaries: each a sentence."""
    every = [settings for file in files if isinstance(settings := _settings(file.parent), dict)]
    for key, (what, judged) in _JUDGED_BY.items():
        if len({json.dumps(settings[key], sort_keys=True) for settings in every if key in settings}) > 1:
            yield f"the runs do not have the same {what} ({key}=...), so their {judged} do not compare"


def _csv(names: Sequence[str], table: Sequence[Mapping[str, str]]) -> str:
    page = io.StringIO()
    writer = csv.DictWriter(page, names, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(table)
    return page.getvalue()
