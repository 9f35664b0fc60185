"""What effects do in the planar model, put together from the library; all of this is called by kernels alone.

Terms act in the order of their places. Each is given what came out of the one before it and gives on what it makes of
it. The body of each function here depends on the class of the numbers `p`, and so on the library (`PlanarParameters`).
"""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from twbal.core.compiled import kernel, method_kernel, specialised, type_of
from twbal.core.gaussian import Array
from twbal.core.quantities import Quantity
from twbal.core.quantities import changed as _changed
from twbal.core.robot_model import AxleMotion, DriveTrain, Frame, Ground, JointMotion, Reading
from twbal.effects.effect import AxleTerm, JointTerm, SensorTerm, TorqueTerm
from twbal.effects.parameter import parameters_of
from twbal.planar.parameters import SHEET, EffectFields, PlanarParameters

Term = Callable[[Any, Any, Any], Any]
"""Method of an effect: of its parameters, what comes in, and where or when it acts."""

changed = kernel(is_kept=False)(_changed)


def _chain(steps: Iterable[EffectFields], method: str, gives: type, value: Any, at: Any) -> Term:
    """One function of p, what comes in, and where or when, which lets the terms act one after the other.

    Args:
        steps: effects, in the order in which they act.
        method: of each of them, its term.
        gives: class of what the terms return.
        value: numba's type of what comes in.
        at: numba's type of where or when.
    """
    chain: Term = kernel(is_kept=False, is_inlined=True)(lambda p, x, at: x)
    for own in steps:
        parameters = type_of(own.values(*[0.0] * (own.end - own.first)))
        chain = _after(chain, method_kernel(own.kind, method, (parameters, value, at), gives), own)
    return chain


def _after(before: Term, term: Term, own: EffectFields) -> Term:
    values, first, end = own.values, own.first, own.end
    return kernel(is_kept=False, is_inlined=True)(lambda p, x, at: term(values(*p[first:end]), before(p, x, at), at))


def _ordered(parameters: type[PlanarParameters]) -> list[EffectFields]:
    """The effects in the order in which they act."""
    return sorted(parameters.effects, key=lambda own: (own.kind.place, own.kind.is_last))


def _through(kind: type, method: str, gives: type = float, is_backward: bool = False) -> Callable[..., Term]:
    """What chooses, for a class of numbers, the chain of those effects that are of a kind."""

    def chosen(numbers: Any, value: Any, at: Any) -> Term:
        acting = [own for own in _ordered(numbers.instance_class) if issubclass(own.kind, kind)]
        chain = _chain(acting[::-1] if is_backward else acting, method, gives, value, at)
        return lambda p, value, at: chain(p, value, at)

    return chosen


def _changing(numbers: Any) -> Callable[[Any], Any]:
    starts = tuple(_start(quantity) for quantity in Quantity)
    changes = tuple(
        (int(quantity), int(change), own.first + i)
        for own in _ordered(numbers.instance_class)
        for i, parameter in enumerate(parameters_of(own.kind).values())
        for quantity, change in parameter.changes
    )

    def quantities(p: PlanarParameters) -> Array:
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
    parts = (Frame(), DriveTrain(), Ground())
    return -1, next((float(getattr(part, name)) for part in parts if hasattr(part, name)), 0.0)


@specialised(_through(TorqueTerm, "drive"))
def drive(p: PlanarParameters, value: float, at: float) -> float:
    """What drivers, gears and motors make of a summed torque [N·m] at a time since the rollout began [s]."""
    raise NotImplementedError


@specialised(_through(JointTerm, "turn"))
def turn(p: PlanarParameters, value: float, at: JointMotion) -> float:
    """The summed torque in the joints [N·m] with what effects add to it."""
    raise NotImplementedError


@specialised(_through(AxleTerm, "push"))
def push(p: PlanarParameters, value: float, at: AxleMotion) -> float:
    """The force at the axle [N] with what effects add to it."""
    raise NotImplementedError


@specialised(_through(SensorTerm, "sense", Reading))
def sense(p: PlanarParameters, value: Reading, at: float) -> Reading:
    """What sensors show of the truth at a time since the rollout began [s]."""
    raise NotImplementedError


@specialised(_through(SensorTerm, "correct", Reading, is_backward=True))
def correct(p: PlanarParameters, value: Reading, at: float) -> Reading:
    """The truth, by what sensors show."""
    raise NotImplementedError


@specialised(_changing)
def quantities(p: PlanarParameters) -> Array:
    """The quantities of the robot (`Quantity`), with its effects."""
    raise NotImplementedError
