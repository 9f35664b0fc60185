"""Put runs of Algorithm 1, and sweeps of them, beside each other."""

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from omegaconf import DictConfig, ListConfig

from twbal.algorithm.comparison import Run, latex, rows, unmeasured, without_pairs
from twbal.cli.artefacts import POLICY_ENDING
from twbal.cli.compared_runs import (
    SUMMARY,
    FoundRun,
    Incomparable,
    by_swept_settings,
    found_runs,
    incomparable,
    left_out,
    unpaired,
)
from twbal.cli.console import run_folder
from twbal.cli.manifest import StageWork, perform_anew
from twbal.cli.typed_config import recorded, typed
from twbal.core.errors import ConfigError, DataError
from twbal.core.files import write_atomically
from twbal.viz.canvas import svg
from twbal.viz.comparison_figure import comparison_figure
from twbal.viz.page import inline, render


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
    runs = {} if files else _runs(folders)
    tested = None
    if settings.robustness:  # found before anything is drawn, so that what is wrong with them is said at once
        from twbal.cli.robustness_stage import compare_robustness, tested_policies  # here, as it loads MuJoCo

        tested = tested_policies(cfg, _policies(folders, runs, files))
    judged = incomparable([each for found in runs.values() for each in found])
    doubts = [*filter(None, (left_out(*each) for each in folders.items())), *unpaired(runs), *judged.doubts]
    for doubt in doubts:
        print(f"WARNING: {doubt}")

    def make() -> list[Path]:
        groups = {name: [each.run for each in found] for name, found in runs.items()}
        made = _compare_runs(groups, out, Incomparable(judged.metrics, tuple(doubts))) if groups else []
        return made if tested is None else [*made, *compare_robustness(cfg, tested, out)]

    step = StageWork("compare", out, recorded(cfg, ()), {}, settings.seed)
    made = [out / output.path for output in perform_anew(step, make).outputs]
    for file in made:
        print(f"made  {file}")
    pages = [str(file) for file in made if file.suffix == ".html"]
    print(f"next  look at {' and '.join(pages)}")


def _runs(folders: Mapping[str, Path]) -> dict[str, list[FoundRun]]:
    """The runs below folders; those of a sweep of several settings in groups of their own."""
    found = {name: found_runs(_summaries(path)) for name, path in folders.items()}
    return {name: runs for group, each in found.items() for name, runs in by_swept_settings(group, each).items()}


def _policies(
    folders: Mapping[str, Path], runs: Mapping[str, Sequence[FoundRun]], files: Sequence[Path]
) -> dict[str, list[Path]]:
    """Policy files, and folders of runs, by the name of their group."""
    if not files:
        return {name: [each.folder for each in found] for name, found in runs.items()}
    return {
        name: [path] if path in files else [file.parent for file in _summaries(path)] for name, path in folders.items()
    }


def _compare_runs(groups: Mapping[str, Sequence[Run]], out: Path, judged: Incomparable) -> list[Path]:
    """Print and write tables, figure and page of what runs came to.

    Args:
        groups: runs by the name of their group.
        out: run folder.
        judged: what does not compare, and all that was warned of.
    """
    compared = unmeasured(groups, judged.metrics)
    table = rows(compared)
    names = list(dict.fromkeys(key for row in table for key in row))
    figure = comparison_figure(compared, judged.metrics)
    drawn = svg(figure)
    write_atomically(out / "comparison.svg", drawn)
    picture = inline(drawn, "comparison", "Every metric of every run, by group")
    page = render(
        "comparison.html.jinja", groups=groups, rows=table, names=names, picture=picture, doubts=judged.doubts
    )
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
        print(f"no run of {name} has robot and seeds of one of {next(iter(groups))}: - stands where pairs would")
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


def _csv(names: Sequence[str], table: Sequence[Mapping[str, str]]) -> str:
    page = io.StringIO()
    writer = csv.DictWriter(page, names, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(table)
    return page.getvalue()
