"""A value on its way through the functions of a package; scripts/follow_parameter.py says how it counts."""

import ast
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from parameter_walk.code import CONFIGURATION, Code, Function

_AS_IT_IS = ("float", "int", "str", "list", "tuple")  # make another type of a value, but no other value


class Stop(NamedTuple):
    """Where a value is read or passed on.

    Attributes:
        module: path below the package.
        function: in it.
        line: of the file.
    """

    module: str
    function: str
    line: int


@dataclass
class Scope:
    """What names stand for in a function: classes (or functions) that they hold, and which hold the value itself."""

    function: Function
    types: dict[str, set[str]]
    values: set[str]


class Walk:
    """One walk; `stops` are where the value is read or passed on, in order.

    Args:
        code: the package.
        what: name of a parameter, of a class (`Channels`) or of a module (`diagnosis.settings`).
        start: function where it begins.
    """

    def __init__(self, code: Code, what: str, start: Function) -> None:
        self.code, self.stops = code, list[Stop]()
        place = f"{what.replace('.', '/')}.py"
        self._kinds = {name for name, each in code.classes.items() if what == each.node.name or place == each.module}
        self._name = "" if self._kinds else what
        self._holders = {(name, self._name) for name, each in code.classes.items() if self._name in each.fields}
        known = -1
        while known < len(self._holders):  # fields that turn out to hold the value under another name
            known, self.stops, self._entered = len(self._holders), [], set[tuple[int, frozenset[str]]]()
            self._carriers = self._carrying()
            self._enter(start, {}, set())

    @property
    def modules(self) -> list[str]:
        """Those visited, in order."""
        return list(dict.fromkeys(stop.module for stop in self.stops))

    def returns(self, layers: dict[str, int]) -> int:
        """Steps up to a higher layer."""
        levels = [layers.get(stop.module.split("/")[0], max(layers.values())) for stop in self.stops]
        return sum(after > before for before, after in pairwise(levels))

    def _carrying(self) -> set[str]:
        """Classes of objects that have the value somewhere."""
        found = {name for name, _ in self._holders} | {*self._kinds, CONFIGURATION}
        while True:
            more = {n for n, each in self.code.classes.items() if any(types & found for types in each.fields.values())}
            if more <= found:
                return found
            found |= more

    def _enter(self, function: Function, types: dict[str, set[str]], values: set[str]) -> None:
        """Go into a function with what its parameters hold."""
        hands = (id(function.node), frozenset(values))
        if hands in self._entered:
            return
        self._entered.add(hands)
        said = {arg.arg: self.code.types_in(function.module, arg.annotation) for arg in function.parameters}
        scope = Scope(function, {n: said.get(n) or types.get(n, set()) for n in {*said, *types}}, set(values))
        if function.owner:
            scope.types.setdefault("self", {function.owner})
        if self._name in said:
            scope.values.add(self._name)
        for statement in function.node.body:
            self._look(statement, scope)

    def _look(self, node: ast.AST, scope: Scope) -> None:
        """Evaluate a part of a function in its order."""
        if isinstance(node, ast.Assign | ast.AnnAssign | ast.NamedExpr) and node.value is not None:
            self._look(node.value, scope)
            for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
                self._bind(target, node.value, scope, getattr(node, "annotation", None))
        elif isinstance(node, ast.For):
            self._look(node.iter, scope)
            self._bind(node.target, node.iter, scope)
            self._all(node.body + node.orelse, scope)
        elif isinstance(node, ast.With):
            for item in node.items:
                self._look(item.context_expr, scope)
                if item.optional_vars:
                    self._bind(item.optional_vars, item.context_expr, scope)
            self._all(node.body, scope)
        elif isinstance(node, ast.ListComp | ast.SetComp | ast.GeneratorExp | ast.DictComp):
            for part in node.generators:
                self._look(part.iter, scope)
                self._bind(part.target, part.iter, scope)
                self._all(part.ifs, scope)
            self._all([node.key, node.value] if isinstance(node, ast.DictComp) else [node.elt], scope)
        elif isinstance(node, ast.Call):
            self._all([*ast.iter_child_nodes(node)], scope)
            self._call(node, scope)
        elif isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Load):
            self._read(node, scope)
        elif isinstance(node, ast.FunctionDef | ast.Lambda):
            body = node.body if isinstance(node.body, list) else [node.body]
            self._all(body, scope)
        else:
            self._all([*ast.iter_child_nodes(node)], scope)

    def _all(self, nodes: Iterable[ast.AST], scope: Scope) -> None:
        for node in nodes:
            self._look(node, scope)

    def _bind(self, target: ast.AST, value: ast.expr, scope: Scope, said: ast.expr | None = None) -> None:
        """Give names what an expression holds."""
        types = self.code.types_in(scope.function.module, said) or self._types(value, scope)
        for node in ast.walk(target):
            if isinstance(node, ast.Name):
                scope.types[node.id] = types
                if (isinstance(target, ast.Name) and self._is_value(value, scope)) or node.id == self._name:
                    scope.values.add(node.id)

    def _read(self, node: ast.Name | ast.Attribute, scope: Scope) -> None:
        if self._is_value(node, scope):
            function = scope.function.node.name
            self.stops.append(Stop(scope.function.module, function, node.lineno))
        if isinstance(node, ast.Attribute):
            if not isinstance(node.value, ast.Name) or self._is_value(node.value, scope):
                self._look(node.value, scope)
            for owner in sorted(self._types(node.value, scope) & self._carriers):
                method = self.code.method(owner, node.attr)
                if method and method.is_property:
                    self._enter(method, {"self": {owner}}, set())

    def _is_value(self, node: ast.expr, scope: Scope) -> bool:
        """Whether an expression is the value itself."""
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in _AS_IT_IS:
            return bool(node.args) and self._is_value(node.args[0], scope)
        if self._kinds:
            own = scope.function.owner in self._kinds
            return (
                isinstance(node, ast.Name | ast.Attribute) and bool(self._kinds & self._types(node, scope)) and not own
            )
        if isinstance(node, ast.Name):
            return node.id in scope.values
        if not isinstance(node, ast.Attribute):
            return False
        owners = self._types(node.value, scope)
        held = any((owner, node.attr) in self._holders for name in owners for owner in self._ancestry(name))
        return held or (node.attr == self._name and owners <= {CONFIGURATION})

    def _ancestry(self, name: str) -> list[str]:
        return [f"{each.module}:{each.node.name}" for each in self.code.lineage(name)]

    def _types(self, node: ast.expr, scope: Scope) -> set[str]:
        """Classes of what an expression holds, or of what is in it."""
        if isinstance(node, ast.Name):
            name = self.code.resolve(scope.function.module, node.id)
            return scope.types.get(node.id) or ({name} & set(self.code.functions))
        if isinstance(node, ast.Attribute):
            return self._attribute_types(node, scope)
        if isinstance(node, ast.Call):
            return self._call_types(node, scope)
        if isinstance(node, ast.Subscript | ast.Starred):
            return self._types(node.value, scope)
        if isinstance(node, ast.IfExp):
            return self._types(node.body, scope) | self._types(node.orelse, scope)
        if isinstance(node, ast.List | ast.Tuple):
            return set().union(*(self._types(each, scope) for each in node.elts)) if node.elts else set()
        if isinstance(node, ast.ListComp | ast.GeneratorExp):
            return self._types(node.elt, scope)
        return set()

    def _attribute_types(self, node: ast.Attribute, scope: Scope) -> set[str]:
        found: set[str] = set()
        for owner in self._types(node.value, scope):
            if owner == CONFIGURATION:
                found.add(owner)
            for each in self.code.lineage(owner):
                found |= each.fields.get(node.attr, set())
                method = each.methods.get(node.attr)
                if method and method.is_property:
                    found |= self.code.types_in(each.module, method.node.returns)
        return found

    def _call_types(self, node: ast.Call, scope: Scope) -> set[str]:
        name = self.code.resolve(scope.function.module, node.func.id) if isinstance(node.func, ast.Name) else ""
        if name in self.code.classes:
            return {name}
        if isinstance(node.func, ast.Name) and node.func.id in (*_AS_IT_IS, "partial", "sorted") and node.args:
            return self._types(node.args[0], scope)
        called = self._called(node, scope)
        found = set().union(*(self.code.types_in(f.module, f.node.returns) for f, _ in called), set())
        given = {self.code.resolve(scope.function.module, arg.id) for arg in node.args if isinstance(arg, ast.Name)}
        return found or (given & set(self.code.classes) if called else set())  # as `typed(Settings, cfg)` makes

    def _called(self, node: ast.Call, scope: Scope) -> list[tuple[Function, str | None]]:
        """Functions that a call may go to, and the class of the object it is called on."""
        module, functions = scope.function.module, self.code.functions
        if isinstance(node.func, ast.Name):
            return [(functions[name], None) for name in sorted(self._types(node.func, scope)) if name in functions]
        if not isinstance(node.func, ast.Attribute):
            return []
        owners = sorted(self._types(node.func.value, scope))
        if isinstance(node.func.value, ast.Name):
            owners += [o for o in [self.code.resolve(module, node.func.value.id)] if o in self.code.classes]
        found = []
        for owner in owners:
            method = self.code.method(owner, node.func.attr)
            if method and any("abstractmethod" in ast.unparse(d) for d in method.node.decorator_list):
                several = [(self.code.method(child, node.func.attr), child) for child in self.code.children(owner)]
                found += [(each, child) for each, child in several if each and child in self._carriers]
            elif method:
                found.append((method, owner))
        return found

    def _call(self, node: ast.Call, scope: Scope) -> None:
        """Follow a call that hands the value on, or something that has it."""
        if isinstance(node.func, ast.Name) and node.func.id == "partial" and node.args:
            node = ast.copy_location(ast.Call(node.args[0], node.args[1:], node.keywords), node)
        name = self.code.resolve(scope.function.module, node.func.id) if isinstance(node.func, ast.Name) else ""
        if name in self.code.classes:
            self._construct(name, node, scope)
        for function, owner in self._called(node, scope):
            given = self._given([arg.arg for arg in function.parameters], node)
            values = {parameter for parameter, each in given.items() if self._is_value(each, scope)}
            types = {parameter: self._types(each, scope) for parameter, each in given.items()}
            said = [self.code.types_in(function.module, arg.annotation) for arg in function.parameters]
            if owner:
                types["self"] = {owner}
            near = function.module == scope.function.module
            if near or values or any(each & self._carriers for each in (*types.values(), *said)):
                self._enter(function, types, values)

    def _construct(self, name: str, node: ast.Call, scope: Scope) -> None:
        """Note which fields of a new object hold the value, and go into what makes it."""
        made = self.code.method(name, "__init__")
        own = [each.fields for each in reversed([*self.code.lineage(name)])]
        names = (
            [arg.arg for arg in made.parameters] if made else list(dict.fromkeys(key for each in own for key in each))
        )
        given = self._given(names, node)
        values = {key for key, each in given.items() if not self._kinds and self._is_value(each, scope)}
        if made:
            self._enter(made, {key: self._types(each, scope) for key, each in given.items()}, values)
        else:
            self._holders |= {(name, key) for key in values}
            check = self.code.method(name, "__post_init__")
            if check and values:
                self._enter(check, {}, set())

    @staticmethod
    def _given(names: list[str], node: ast.Call) -> dict[str, ast.expr]:
        """Arguments of a call by the names of the parameters."""
        positional = [arg for arg in node.args if not isinstance(arg, ast.Starred)]
        return dict(zip(names, positional, strict=False)) | {k.arg: k.value for k in node.keywords if k.arg in names}


def commands(code: Code) -> dict[str, Function]:
    """Where walks begin: `run` of each command."""
    found = {
        Path(name.split(":")[0]).stem: function for name, function in code.functions.items() if name.endswith(":run")
    }
    return {name: function for name, function in found.items() if function.module.startswith("cli/stages/")}


@cache
def walks(code: Code, what: str) -> dict[str, Walk]:
    """The walk of a parameter through each command that it goes through, the longest first."""
    found = {name: Walk(code, what, start) for name, start in commands(code).items()}
    return dict(sorted(((n, w) for n, w in found.items() if w.stops), key=lambda each: -len(each[1].modules)))
