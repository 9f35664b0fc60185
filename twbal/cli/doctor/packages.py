"""Python, the packages that twbal needs, and the kernels that one of them compiles."""

import os
import platform
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement
from packaging.version import Version

from twbal.core.check import Check, CheckStatus

_INSTALL = "Install by `make .venv/.installed` in the checkout, or `pip install -e . -c constraints.txt`"
_LISTED = 3
_MANY_CACHES = 10  # folders of some 30 MB each


def installed_version(package: str) -> str | None:
    """Version of an installed package; None where it is not installed."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def package_checks(pins: Mapping[str, str]) -> list[Check]:
    """Python and packages, by what the installed twbal says that it needs.

    Args:
        pins: see `packages_check`.
    """
    try:
        own = metadata.metadata("twbal")
    except metadata.PackageNotFoundError:
        return [Check("packages", CheckStatus.PROBLEM, "twbal itself is not installed", advice=f"{_INSTALL}.")]
    return [python_check(own["Requires-Python"]), packages_check(own.get_all("Requires-Dist") or (), pins)]


def python_check(needed: str, found: str = platform.python_version()) -> Check:
    """Whether this Python is one that twbal runs on.

    Args:
        needed: versions, such as `>=3.11,<3.12`.
        found: its version.
    """
    fits = Version(found) in Requirement(f"python{needed}").specifier
    verdict = CheckStatus.OK if fits else CheckStatus.PROBLEM
    return Check("python", verdict, f"{found} ({sys.executable})", needed, "" if fits else f"{_INSTALL}.")


def packages_check(
    requirements: Iterable[str], pins: Mapping[str, str], version: Callable[[str], str | None] = installed_version
) -> Check:
    """Whether what twbal needs is installed, and as it was tested.

    Args:
        requirements: as a package's metadata states them; those of extras are not looked at.
        pins: the tested version of each package; empty where they are not known.
        version: finds what is installed.
    """
    needed = [each for each in map(Requirement, requirements) if each.marker is None or each.marker.evaluate()]
    found = {each.name: version(each.name) for each in needed}
    wrong = [_lacking(each, found[each.name]) for each in needed if not _fits(each, found[each.name])]
    if wrong:
        return Check("packages", CheckStatus.PROBLEM, _some(wrong), advice=f"{_INSTALL}.")
    moved = [f"{name} {now} (tested with {pins[name]})" for name, now in found.items() if _differs(now, pins.get(name))]
    if moved:
        return Check("packages", CheckStatus.WARNING, _some(moved), advice=f"{_INSTALL} where something fails.")
    tested = ", in the versions of constraints.txt" if pins else ""
    return Check("packages", CheckStatus.OK, f"all {len(needed)} that twbal needs{tested}")


def pinned_versions(constraints: Path) -> dict[str, str]:
    """The version of each package by a file of constraints; none where there is no such file."""
    try:
        lines = constraints.read_text().splitlines()
    except OSError:
        return {}
    return dict(line.split("==", 1) for line in lines if "==" in line and not line.startswith("#"))


def kernels_check(folder: Path) -> Check:
    """Whether compiled kernels are kept, and are there.

    Args:
        folder: where numba keeps them.
    """
    if not os.access(folder, os.W_OK | os.X_OK):
        advice = "Set XDG_CACHE_HOME, or NUMBA_CACHE_DIR, to a folder that you may write to."
        return Check("compiled kernels", CheckStatus.PROBLEM, f"{folder} cannot be written to", advice=advice)
    kept = len(list(folder.rglob("*.nbc")))
    if folder.is_relative_to(tempfile.gettempdir()):
        advice = "Set XDG_CACHE_HOME to a folder that stays, so that they are not compiled anew."
        return Check("compiled kernels", CheckStatus.WARNING, f"kept in the temporary folder {folder}", advice=advice)
    if not kept:
        advice = "The first commands compile for minutes: run `twbal iterate` with the virtual robot before yours."
        return Check("compiled kernels", CheckStatus.WARNING, f"none yet in {folder}", advice=advice)
    others = len(list(folder.parent.glob("kernels-*"))) - 1
    if others < _MANY_CACHES:
        return Check("compiled kernels", CheckStatus.OK, f"{kept} in {folder}")
    found = f"{kept} in {folder}, and folders of {others} other versions beside it"
    return Check(
        "compiled kernels", CheckStatus.OK, found, advice="docs/troubleshooting.md says how to remove old ones."
    )


def _fits(needed: Requirement, found: str | None) -> bool:
    return found is not None and needed.specifier.contains(found, prereleases=True)


def _lacking(needed: Requirement, found: str | None) -> str:
    return f"{needed.name} is not installed" if found is None else f"{needed.name} is {found}, not {needed.specifier}"


def _differs(found: str | None, pin: str | None) -> bool:
    return None not in (found, pin) and str(found).partition("+")[0] != pin


def _some(phrases: list[str]) -> str:
    more = [f"and {len(phrases) - _LISTED} more"] if len(phrases) > _LISTED else []
    return ", ".join([*phrases[:_LISTED], *more])
