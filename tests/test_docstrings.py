"""Entries of docstrings name what there is: fields of a class, parameters of a function. A list of fields is whole."""

import ast
import gc
import re
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "twbal"
OTHERS = "others"  # an entry for the rest, whose names say enough
NAMED_AS_ELSEWHERE = ("virtual_robot/robot_constants.py: RobotConstants",)
"""Whose other fields are those of what their docstring refers to."""
_ENTRY = re.compile(r"^ {4}(\w+(?:, \w+)*):", re.MULTILINE)


@pytest.fixture(scope="module")
def definitions():
    """All classes, functions and methods, each with the path of its module."""
    gc.disable()  # which else takes twice as long as the parser
    try:
        trees = [(path.relative_to(PACKAGE).as_posix(), ast.parse(path.read_text())) for path in PACKAGE.rglob("*.py")]
        return [(place, node) for place, tree in trees for node in defined_in(tree)]
    finally:
        gc.enable()


def defined_in(node):
    """Classes and functions of a module or a class, and what is defined in classes."""
    for each in node.body:
        if isinstance(each, (ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)):
            yield each
        if isinstance(each, ast.ClassDef):
            yield from defined_in(each)


def entries(node, section):
    """Names that have an entry in a section of a docstring, such as `Args`; None where it has no such section."""
    found = re.search(rf"^{section}:\n((?: {{4}}.*\n|\n)*)", f"{ast.get_docstring(node) or ''}\n", re.MULTILINE)
    return {name for names in _ENTRY.findall(found[1]) for name in names.split(", ")} if found else None


def with_bases(node, classes):
    """A class and all from which it is derived, as far as they are of the package."""
    bases = [ast.unparse(base).partition("[")[0] for base in node.bases]
    return [node, *(each for base in bases for known in classes.get(base, ()) for each in with_bases(known, classes))]


def fields(node):
    """Names of the fields that a class declares; no variables of the class."""
    declared = [each for each in node.body if isinstance(each, ast.AnnAssign) and isinstance(each.target, ast.Name)]
    return {each.target.id for each in declared if "ClassVar" not in ast.unparse(each.annotation)}


def members(node):
    """All names that its objects may have."""
    found = {each.name for each in node.body if isinstance(each, ast.FunctionDef)}
    for each in ast.walk(node):
        if isinstance(each, ast.Attribute) and isinstance(each.ctx, ast.Store):
            found.add(each.attr)
    for each in node.body:
        targets = (
            each.targets if isinstance(each, ast.Assign) else [each.target] if isinstance(each, ast.AnnAssign) else []
        )
        found |= {target.id for target in targets if isinstance(target, ast.Name)}
    return found


def parameters(node):
    """Names of a function's parameters."""
    known = node.args
    one = [each for each in (known.vararg, known.kwarg) if each is not None]
    return {each.arg for each in (*known.posonlyargs, *known.args, *known.kwonlyargs, *one)}


def wrong_in(place, node, classes):
    """What is wrong with the docstring of a class or a function."""
    if isinstance(node, ast.ClassDef):
        listed = entries(node, "Attributes")
        if listed is None:
            return
        family = with_bases(node, classes)
        for name in sorted(listed - set().union(*map(members, family)) - {OTHERS}):
            yield f"{place}: {node.name} has no {name}"
        told = listed.union(*(entries(base, "Attributes") or set() for base in family))
        if OTHERS not in told and f"{place}: {node.name}" not in NAMED_AS_ELSEWHERE:
            for name in sorted(fields(node) - told):
                if not name.startswith("_"):
                    yield f"{place}: {node.name} lists other fields than {name}"
    elif listed := entries(node, "Args"):
        for name in sorted(listed - parameters(node) - {OTHERS}):
            yield f"{place}: {node.name} has no parameter {name}"


def test_entries_of_docstrings_are_fields_and_parameters_and_a_list_of_fields_is_whole(definitions):
    classes = {}
    for _, node in definitions:
        if isinstance(node, ast.ClassDef):
            classes.setdefault(node.name, []).append(node)
    assert len(classes) > 300
    wrong = [line for place, node in definitions for line in wrong_in(place, node, classes)]
    assert not wrong, "\n".join(wrong)


BASE = """
class Base:
    \"\"\"A base.

    Attributes:
        first: [m].
    \"\"\"

    first: float
    kind: ClassVar[str]
"""


@pytest.mark.parametrize(
    ("written", "wrong"),
    [
        ("Attributes:\n        second, third: [m].", []),
        ("Attributes:\n        second: [m].\n\n    Raises:\n        DataError: no.", ["lists other fields than third"]),
        ("Attributes:\n        second: [m].\n        others: of the sheet.", []),
        ("Attributes:\n        second, third: [m].\n        fourth: [m].", ["has no fourth"]),
        ("More.", []),
    ],
)
def test_what_is_wrong_with_a_list_of_fields_is_found(written, wrong):
    text = f'class Derived(Base):\n    """A class.\n\n    {written}\n    """\n\n    second: float\n    third: float\n'
    base, derived = ast.parse(BASE + text).body
    known = {"Base": [base]}
    assert [each.removeprefix("a.py: Derived ") for each in wrong_in("a.py", derived, known)] == wrong


FUNCTION = """
def run(one, *rest, two):
    \"\"\"Run.

    Args:
        one, two: [m].
        rest: [m].
        old: [m].
    \"\"\"
"""


def test_a_parameter_that_a_function_does_not_have_is_found():
    (function,) = ast.parse(FUNCTION).body
    assert list(wrong_in("a.py", function, {})) == ["a.py: run has no parameter old"]
