"""What the jobs of a sweep came to, one line each."""

from pathlib import Path

from twbal.core.errors import DataError

FAILURE = "failure.log"
"""In the folder of a job that failed: its overrides, what went wrong, and which sweep it was of, one line each."""

_SUMMARY = "summary.json"
_OF_A_JOB = (".hydra", "manifest.json", FAILURE)  # one is in each job's folder; hidden ones are not always copied
_LONGEST = 100  # characters of what went wrong


def job_lines(sweep: Path) -> list[str]:
    """Folder within the sweep and result of each job, also of those that earlier goes left there.

    Args:
        sweep: its folder.
    """
    folders = job_folders(sweep)
    names = [str(folder.relative_to(sweep)) for folder in folders]
    width = max(map(len, names), default=0)
    return [f"  {name:{width}}  {result_of(folder)}" for name, folder in zip(names, folders, strict=True)]


def job_folders(sweep: Path) -> list[Path]:
    """The folders of the jobs, in order, also of those that earlier goes left there.

    Args:
        sweep: its folder.
    """
    folders: list[Path] = []
    for folder in sorted({path.parent for path in sweep.glob("*/**/*") if path.name in _OF_A_JOB}):
        if not any(job in folder.parents for job in folders):
            folders.append(folder)
    return folders


def result_of(folder: Path) -> str:
    """What a job came to, in words.

    Args:
        folder: of the job.
    """
    from twbal.cli.manifest import (
        read_manifest,
    )  # here, as it loads NumPy, which jobs elsewhere have to set threads for

    failure = folder / FAILURE
    if failure.is_file():
        _, said, *_ = [*failure.read_text(encoding="utf-8").split("\n"), "", ""]
        return f"failed: {said if len(said) <= _LONGEST else f'{said[:_LONGEST]}...'}"
    try:
        if (folder / _SUMMARY).is_file():
            return _of_iterate(folder / _SUMMARY)
        manifest = read_manifest(folder)
    except DataError:
        return "not readable"
    return "not finished" if manifest is None or not manifest.complete else "done"


def _of_iterate(file: Path) -> str:
    from twbal.algorithm.summary import read_summary  # here, as only sweeps of iterate need it

    summary = read_summary(file)
    successes, trials = summary.count(summary.best_iteration)
    best = f"the best policy is that of iteration {summary.best_iteration}"
    seconds = f"{summary.iterations[-1].real_seconds:.3g} s driven to learn"
    return f"{successes} of {trials} trials succeed; {best}; {seconds}" if trials else f"no trials; {seconds}"
