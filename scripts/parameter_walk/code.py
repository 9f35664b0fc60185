"""A package as its source says it: functions, classes, fields and their types, and what each module imports."""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

CONFIGURATION = "DictConfig"
"""Stands for the type of a configuration, which may hold anything."""


@dataclass
class Class:
    """A class: its module, its fields with the classes in their annotations, and its functions."""

    module: str
    node: ast.ClassDef
    bases: list[str]
    fields: dict[str, set[str]] = field(default_factory=dict)
    methods: dict[str, "Function"] = field(default_factory=dict)


@dataclass
class Function:
    """A function, where it stands, and the class that it belongs to."""

    module: str
    node: ast.FunctionDef
    owner: str | None = None

    @property
    def parameters(self) -> list[ast.arg]:
        """Those with a name of their own, `self` apart."""
        own = [*self.node.args.posonlyargs, *self.node.args.args, *self.node.args.kwonlyargs]
        bound = self.owner and not any(
            isinstance(d, ast.Name) and d.id == "staticmethod" for d in self.node.decorator_list
        )
        return own[1:] if bound else own

    @property
    def is_property(self) -> bool:
        """Whether it is read like a field."""
        return any("property" in ast.unparse(each) for each in self.node.decorator_list)


class Code:
    """All modules of a package, by what they define and import.

    Args:
        package: its folder.
    """

    def __init__(self, package: Path) -> None:
        self.name = package.name
        self.imports: dict[str, dict[str, str]] = {}
        self.classes: dict[str, Class] = {}
        self.functions: dict[str, Function] = {}
        trees = {str(path.relative_to(package)): ast.parse(path.read_text()) for path in sorted(package.rglob("*.py"))}
        for module, tree in trees.items():
            self._define(module, tree)
        for each in self.classes.values():
            self._fields(each)

    def _define(self, module: str, tree: ast.Module) -> None:
        names = self.imports.setdefault(module, {})
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == self.name:
                place = "/".join((node.module or "").split(".")[1:])
                for alias in node.names:
                    names[alias.asname or alias.name] = f"{place}.py:{alias.name}"
        for node in tree.body:
            if isinstance(node, ast.ClassDef):
                found = Class(module, node, [ast.unparse(base).split("[")[0] for base in node.bases])
                self.classes[f"{module}:{node.name}"] = found
                for item in node.body:
                    if isinstance(item, ast.FunctionDef):
                        found.methods[item.name] = Function(module, item, f"{module}:{node.name}")
            elif isinstance(node, ast.FunctionDef):
                self.functions[f"{module}:{node.name}"] = Function(module, node)

    def _fields(self, each: Class) -> None:
        for item in each.node.body:
            if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name):
                each.fields[item.target.id] = self.types_in(each.module, item.annotation)
        for method in each.methods.values():
            given = {arg.arg: self.types_in(each.module, arg.annotation) for arg in method.parameters}
            for node in ast.walk(method.node):
                targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
                for target in targets if isinstance(node, ast.Assign | ast.AnnAssign) else ():
                    if isinstance(target, ast.Attribute) and ast.unparse(target.value) == "self":
                        said = getattr(node, "annotation", None)
                        value = node.value.id if isinstance(node.value, ast.Name) else ""
                        types = self.types_in(each.module, said) if said else given.get(value, set())
                        each.fields.setdefault(target.attr, set()).update(types)

    def resolve(self, module: str, name: str) -> str:
        """`module:name` of a name that a module defines or imports, perhaps by way of a package."""
        here = f"{module}:{name}"
        if here in self.classes or here in self.functions:
            return here
        found = self.imports[module].get(name, "")
        place, _, inner = found.partition(":")
        package = place.replace(".py", "/__init__.py")
        if found not in self.classes and found not in self.functions and package in self.imports:
            return self.resolve(package, inner)
        return found

    def types_in(self, module: str, annotation: ast.expr | None) -> set[str]:
        """Classes of the package that an annotation names, however deep."""
        found: set[str] = set()
        for node in ast.walk(annotation) if annotation else ():
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.isidentifier():
                node = ast.Name(node.value)
            if isinstance(node, ast.Name):
                name = self.resolve(module, node.id)
                found |= {name} & set(self.classes) or ({CONFIGURATION} if node.id == CONFIGURATION else set())
        return found

    def lineage(self, name: str) -> Iterator[Class]:
        """A class and those that it inherits from."""
        each = self.classes.get(name)
        if each:
            yield each
            for base in each.bases:
                yield from self.lineage(self.resolve(each.module, base))

    def method(self, name: str, called: str) -> Function | None:
        """A function of a class or of one that it inherits from."""
        return next((each.methods[called] for each in self.lineage(name) if called in each.methods), None)

    def children(self, name: str) -> list[str]:
        """Classes that inherit from one."""
        return [c for c, each in self.classes.items() if name in (self.resolve(each.module, b) for b in each.bases)]


def layers(root: Path) -> dict[str, int]:
    """Layer of each folder, as docs/architecture.md says."""
    page = (root / "docs" / "architecture.md").read_text()
    return {name: int(number) for number, name in re.findall(r"^\| (\d+) \| `(\w+)/` \|", page, flags=re.MULTILINE)}
