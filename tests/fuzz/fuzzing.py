"""What the fuzz tests share: how many examples, mutations of whole files, and what is allowed to happen."""

from contextlib import suppress

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from twbal.core.errors import TwbalError

_ALWAYS = {"derandomize": True, "database": None, "deadline": None, "suppress_health_check": list(HealthCheck)}
QUICK = settings(max_examples=25, **_ALWAYS)
MANY = settings(max_examples=500, **_ALWAYS)


def fuzzed(**strategies):
    """A test that calls a function with a path and values of these strategies, in a quick and in a slow variant."""

    def decorate(check):
        @pytest.mark.parametrize(
            "budget", [pytest.param(QUICK, id="quick"), pytest.param(MANY, id="many", marks=pytest.mark.slow)]
        )
        def test(budget, tmp_path):
            settings(budget)(given(**strategies)(lambda **drawn: check(tmp_path / "file", **drawn)))()

        test.__doc__ = check.__doc__
        return test

    return decorate


def ours_only(read, *arguments):
    """What `read` returns; None where it raises an error of twbal. Any other error fails the test."""
    with suppress(TwbalError):
        return read(*arguments)
    return None


@st.composite
def mutated(draw, whole):
    """The bytes of a whole file with some of them changed, taken away, put in, or copied from elsewhere in it."""
    data = bytearray(whole)
    for _ in range(draw(st.integers(1, 5))):
        at, length = draw(st.integers(0, len(data))), draw(st.integers(0, 40))
        match draw(st.integers(0, 3)):
            case 0:
                data[at : at + 1] = draw(st.binary(min_size=1, max_size=1))
            case 1:
                del data[at : at + length]
            case 2:
                data[at:at] = draw(st.binary(max_size=20))
            case _:
                start = draw(st.integers(0, len(data)))
                data[at:at] = data[start : start + length]
    return bytes(data)


odd_numbers = st.one_of(
    st.floats(), st.integers(), st.sampled_from([0, -1, 1e300, 10**400, float("nan"), float("inf"), True])
)
plain = st.recursive(
    st.one_of(st.none(), odd_numbers, st.text(max_size=8)),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)
"""Anything that yaml or JSON can say."""


@st.composite
def changed(draw, tree, values=plain):
    """A nested dict in which one value, somewhere, is another one or gone."""
    if not isinstance(tree, dict) or not tree or draw(st.integers(0, 5)) == 0:
        return draw(values)
    name = draw(st.sampled_from(sorted(tree)))
    rest = {other: value for other, value in tree.items() if other != name}
    kind = draw(st.integers(0, 5))
    if kind == 0:
        return rest
    if kind == 1:
        return {**tree, draw(st.text(max_size=8)): draw(values)}
    return {**rest, name: draw(changed(tree[name], values))}
