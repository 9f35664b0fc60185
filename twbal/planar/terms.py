"""What effects do in the planar model, put together from the library; all of this is called by kernels alone.

Terms act in the order of their places. Each is given what came out of the one before it and gives on what it makes of
it. The body of each function here depends on the class of the numbers `p`, and so on the library (`TwinParameters`).
"""

from collections.abc import Callable, Iterable
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from twbal.core.compiled import kernel, specialised
from twbal.core.gaussian import Array
from twbal.core.quantities import Quantity
from twbal.core.quantities import changed as _changed
from twbal.core.robot_model import AxleMotion, Drive, Ground, JointMotion, Reading
from twbal.effects.effect import AxleTerm, JointTerm, SensorTerm, TorqueTerm
from twbal.effects.parameter import parameters_of
from twbal.planar.parameters import SHEET, Own, TwinParameters

Term = Callable[[Any, Any, Any], Any]
"""Method of an effect: of its parameters, what comes in, and where or when it acts."""

changed = kernel(is_kept=False)(_changed)


class _Step(NamedTuple):
    term: Term
    own: Own


def _chain(steps: Iterable[_Step]) -> Term:
    """One function of p, what comes in, and where or when, which lets the terms act one after the other."""
    chain: Term = kernel(is_kept=False)(lambda p, x, at: x)
    for step in steps:
        chain = _after(chain, kernel(is_kept=False)(step.term), step.own)
    return chain


def _after(before: Term, term: Term, own: Own) -> Term:
    values, first, end = own.values, own.first, own.end
    return kernel(is_kept=False)(lambda p, x, at: term(values(*p[first:end]), before(p, x, at), at))


def _ordered(parameters: type[TwinParameters]) -> list[Own]:
    """The effects in the order in which they act."""
    return sorted(parameters.effects, key=lambda own: (own.kind.place, own.kind.is_last))


def _through(kind: type, term: Callable[[Any], Term], is_backward: bool = False) -> Callable[[Any], Term]:
    """What chooses, for a class of numbers, the chain of those effects that are of a kind."""

    def chosen(parameters: type[TwinParameters]) -> Term:
        acting = [own for own in _ordered(parameters) if issubclass(own.kind, kind)]
        chain = _chain(_Step(term(own.kind), own) for own in (acting[::-1] if is_backward else acting))
        return lambda p, value, at: chain(p, value, at)

    return chosen


def _changing(parameters: type[TwinParameters]) -> Callable[[Any], Any]:
    starts = tuple(_start(quantity) for quantity in Quantity)
    changes = tuple(
        (int(quantity), int(change), own.first + i)
        for own in _ordered(parameters)
        for i, parameter in enumerate(parameters_of(own.kind).values())
        for quantity, change in parameter.changes
    )

    def quantities(p: TwinParameters) -> Array:
        found = np.empty(len(starts))
        for i, (field, otherwise) in enumerate(starts):
            found[i] = p[field] if field >= 0 else otherwise
        for quantity, change, field in changes:
            found[quantity] = changed(found[quantity], change, p[field])
        return found

    return quantities


def _start(quantity: Quantity) -> tuple[int, float]:
    """Field of the data sheet in which a quantity lies, or -1; and its value if it lies in none."""
    name = quantity.name.lower()
    if name in SHEET:
        return SHEET.index(name), 0.0
    return -1, float(getattr(Drive(), name, getattr(Ground(), name, 0.0)))


@specialised(_through(TorqueTerm, attrgetter("drive")))
def drive(p: TwinParameters, value: float, at: float) -> float:
    """What drivers, gears and motors make of a summed torque [N·m] at a time since the rollout began [s]."""
    raise NotImplementedError


@specialised(_through(JointTerm, attrgetter("turn")))
def turn(p: TwinParameters, value: float, at: JointMotion) -> float:
    """The summed torque in the joints [N·m] with what effects add to it."""
    raise NotImplementedError


@specialised(_through(AxleTerm, attrgetter("push")))
def push(p: TwinParameters, value: float, at: AxleMotion) -> float:
    """The force at the axle [N] with what effects add to it."""
    raise NotImplementedError


@specialised(_through(SensorTerm, attrgetter("sense")))
def sense(p: TwinParameters, value: Reading, at: float) -> Reading:
    """What sensors show of the truth at a time since the rollout began [s]."""
    raise NotImplementedError


@specialised(_through(SensorTerm, attrgetter("correct"), is_backward=True))
def correct(p: TwinParameters, value: Reading, at: float) -> Reading:
    """The truth, by what sensors show."""
    raise NotImplementedError


@specialised(_changing)
def quantities(p: TwinParameters) -> Array:
    """The quantities of the robot (`Quantity`), with its effects."""
    raise NotImplementedError
