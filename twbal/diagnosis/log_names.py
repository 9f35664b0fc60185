"""Short names of logs."""

from collections.abc import Collection, Sequence
from pathlib import Path


def distinct_names(paths: Sequence[Path], taken: Collection[str] = ()) -> list[str]:
    """A name for each file, as short as tells them apart: the file's, with the folder's, or the path.

    Args:
        paths: of the files.
        taken: names that none of them may have.
    """
    folders = [path.parent.parent if path.parent.name == "episodes" else path.parent for path in paths]
    choices = (
        [path.stem for path in paths],
        [f"{folder.name}/{path.stem}" for folder, path in zip(folders, paths, strict=True)],
        [str(path) for path in paths],
    )
    return next((names for names in choices if len({*names, *taken}) == len(paths) + len({*taken})), choices[-1])
