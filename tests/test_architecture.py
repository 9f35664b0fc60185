"""The code keeps to docs/architecture.md: imports run downhill, and each foreign library is met in one place."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "twbal"
FOREIGN = {
    "hydra": ("cli/",),
    "omegaconf": ("cli/",),
    "pybullet": ("sim/",),
    "mujoco": ("virtual_robot/",),
    "serial": ("link/transport.py",),
    "mcap": ("io/logs/",),
    "mcap_protobuf": ("io/logs/",),
    "matplotlib": ("viz/",),
    "gpytorch": ("models/kernels/",),
    "torch": ("io/checkpoint.py", "models/kernels/", "search/", "environment/agent_training.py"),
    "gymnasium": ("environment/",),
    "stable_baselines3": ("environment/agent_training.py",),
    "jinja2": ("viz/",),
    "numba": ("core/compiled.py",),
    "llvmlite": ("core/compiled.py",),
    "pandas": ("io/importers/text_files.py", "cli/stages/export.py"),
    "PIL": ("viz/animation.py",),
    "ray": ("cli/ray_launcher.py",),
    "rerun": ("viz/live/scene.py",),
}


def layers():
    """Layer of each folder, as the page's table says."""
    page = (ROOT / "docs" / "architecture.md").read_text()
    return {name: int(number) for number, name in re.findall(r"^\| (\d+) \| `(\w+)/` \|", page, flags=re.MULTILINE)}


def imports(path):
    """Dotted names of what a module imports, wherever in it."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module


MODULES = sorted(p for p in PACKAGE.rglob("*.py") if p.name not in ("__init__.py", "__main__.py"))


def test_every_folder_is_on_a_layer():
    assert {path.relative_to(PACKAGE).parts[0] for path in MODULES} == set(layers())


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_point_to_lower_layers(path):
    here, level = path.relative_to(PACKAGE).parts[0], layers()
    for name in imports(path):
        if name.startswith("twbal."):
            there = name.split(".")[1]
            assert there == here or level[there] < level[here], f"{here} imports {name}"


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_foreign_libraries_are_met_in_one_place(path):
    inside = str(path.relative_to(PACKAGE))
    for name in imports(path):
        places = FOREIGN.get(name.split(".")[0])
        assert places is None or inside.startswith(places), f"{inside} imports {name}"


@pytest.mark.parametrize("path", sorted((PACKAGE / "virtual_robot").glob("*.py")), ids=lambda p: p.name)
def test_the_virtual_robot_shares_nothing_with_what_learns_to_drive_it(path):
    ours = {name.split(".")[1] for name in imports(path) if name.startswith("twbal.")}
    assert ours <= {"core", "link", "virtual_robot"}


def test_the_virtual_robot_loads_nothing_of_what_learns_to_drive_it():
    code = "import sys, twbal.virtual_robot.mujoco_robot, twbal.virtual_robot.drawn, twbal.virtual_robot.server\n"
    code += "print(*(name for name in sys.modules if name.startswith('twbal.')))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert {name.split(".")[1] for name in loaded} == {"core", "link", "virtual_robot"}


LEARNING = ("models/", "search/", "policies/", "sysid/", "planar/motion.py", "algorithm/policy_search.py")


@pytest.mark.parametrize("path", [p for p in MODULES if str(p.relative_to(PACKAGE)).startswith(LEARNING)], ids=str)
def test_what_learns_never_sees_a_true_pose(path):
    """These modules import no pose, and read no attribute that is one, by its name or by a text."""
    for node in ast.walk(ast.parse(path.read_text())):
        match node:
            case ast.Attribute(attr=name) | ast.Constant(value=str(name)):
                assert name not in ("pose", "poses"), f"line {node.lineno}"
            case ast.alias(name=name):
                assert name not in ("Pose", "PoseReport"), f"line {node.lineno}"
