"""The code keeps to docs/architecture.md: imports run downhill, and each foreign library is met in one place."""

import ast
import re
from pathlib import Path

import pytest

HOUSE = Path(__file__).resolve().parent.parent
PACKAGE = HOUSE / "twbal"
FOREIGN = {
    "hydra": ("cli.py", "stages/"),
    "omegaconf": ("cli.py", "stages/"),
    "pybullet": ("sim/",),
    "serial": ("link/transport.py",),
    "mcap": ("logs/",),
    "matplotlib": ("figures/",),
    "gpytorch": ("models/fit.py",),
    "torch": ("checkpoint.py", "models/fit.py", "search/particles.py", "agents/training.py"),
    "gymnasium": ("environment/", "agents/training.py"),
    "stable_baselines3": ("agents/training.py",),
    "jinja2": ("report/",),
    "numba": ("compiled.py",),
    "pandas": ("foreign/text.py", "stages/export.py"),
    "PIL": ("figures/film.py",),
    "ray": ("stages/ray_launcher.py",),
}


def floors():
    """Floor of each room (a folder, or a file right in the package), as the page's table says."""
    page = (HOUSE / "docs" / "architecture.md").read_text()
    found = {}
    for number, text in re.findall(r"^\| (\d+) \| (.*) \|$", page, flags=re.MULTILINE):
        for name in re.findall(r"`(\w+(?:\.py|/))`", text):
            if (PACKAGE / name).exists():
                found[name] = int(number)
    return found


def room(path):
    """The room a module lies in."""
    inside = path.relative_to(PACKAGE).parts
    return inside[0] + "/" if len(inside) > 1 else inside[0]


def imports(path):
    """Dotted names of what a module imports, wherever in it."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module


MODULES = sorted(p for p in PACKAGE.rglob("*.py") if p.name not in ("__init__.py", "__main__.py"))


def test_every_room_stands_on_a_floor():
    assert {room(path) for path in MODULES} == set(floors())


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_run_downhill(path):
    here, level = room(path), floors()
    for name in imports(path):
        if name.startswith("twbal."):
            part = name.split(".")[1]
            there = f"{part}/" if (PACKAGE / part).is_dir() else f"{part}.py"
            assert there == here or level[there] < level[here], f"{here} imports {name}"


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_foreign_libraries_are_met_in_one_place(path):
    inside = str(path.relative_to(PACKAGE))
    for name in imports(path):
        places = FOREIGN.get(name.split(".")[0])
        assert places is None or inside.startswith(places), f"{inside} imports {name}"
