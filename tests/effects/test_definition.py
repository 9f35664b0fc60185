"""What is wrong with the definition of an effect is said where it is defined, with what to write instead."""

import re
import sys
from dataclasses import dataclass, field, make_dataclass
from math import inf

import pytest

import twbal.effects
from twbal.cli.main import main
from twbal.cli.settings.effect_settings import accepted
from twbal.core.errors import ConfigError
from twbal.core.quantities import Quantity
from twbal.effects import library
from twbal.effects.definition import fault_of
from twbal.effects.effect import ActuatorEffect, DriverEffect, OutsideEffect, Place
from twbal.effects.parameter import parameter, parameters_of

RIGHT = {"meaning": "force", "unit": "N", "prior": (0.0, 5.0), "start": 1.0, "value": 2.0}
MINE = {"__module__": __name__}
MODULE = '''
from dataclasses import dataclass
from twbal.effects.effect import DriverEffect
from twbal.effects.library import register
from twbal.effects.parameter import parameter


@register
@dataclass(frozen=True)
class HalfWay(DriverEffect):
    """It gives a share of the torque."""

    share: float = parameter("share", "", (0.1, 1.0), start=0.4, value=0.5, neutral=1.0)
    reference = "Nobody, 1999."
    is_linear = False
    separate_by = "Look."

    def drive(self, torque: float, time: float) -> float:
        """Less."""
        return self.share * torque
'''


@dataclass(frozen=True)
class Windy(OutsideEffect):
    """A wind that pushes."""

    force: float = parameter("force", "N", (-5.0, 5.0), start=1.0, value=2.0)
    reference = "F. Beaufort: Wind, 1805."
    is_linear = False
    separate_by = "Look out."

    def push(self, force, at):
        return force + self.force


@pytest.fixture(autouse=True)
def _no_other_effects(monkeypatch):
    monkeypatch.setattr(library, "_registered", {})


@pytest.mark.parametrize("kind", library.all_effects().values(), ids=library.effect_name)
def test_each_effect_of_twbal_is_defined_as_it_must_be(kind):
    assert fault_of(kind) == ""


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"prior": (-5.0, 5.0), "least": 0.0}, "prior=(-5, 5), least=0 and below=inf; expected is least <= low"),
        ({"prior": (0.0, 5.0), "below": 4.0}, "least=0 and below=4; expected is high < below"),
        ({"prior": (0.0, 5.0), "below": 5.0}, "expected is high < below"),
        ({"prior": (5.0, 0.0)}, "prior=(5, 0); expected is low < high; swap them"),
        ({"prior": 5.0}, "prior=5.0; expected is the range of plausible robots, as (low, high)"),
        ({"prior": (0.0, "5")}, "prior=(0.0, '5'); expected is the range"),
        ({"start": 6.0}, "prior=(0, 5) and start=6; expected is a start that lies within the range"),
        ({"value": -1.0}, "prior=(0, 5) and value=-1; expected is a value that lies within the range"),
        ({"value": None}, "value=None; expected is a number"),
        ({"start": inf}, "start=inf; expected is a number"),
        ({"neutral": -1.0}, "neutral=-1; expected is a neutral value from `least` to `below`"),
        ({"sd": -0.1}, "sd=-0.1 and form=0; expected is sd > 0"),
        ({"form": -0.1}, "form=-0.1; expected is sd > 0 (left out: no prior) and form >= 0"),
        ({"scale": "mass"}, "scale='mass'; expected is Scale.TORQUE"),
        ({"changes": Quantity.BODY_MASS}, "expected is scales(Quantity.BODY_MASS)"),
        ({"unit": (0.0, 5.0)}, "A parameter begins with its meaning and its unit"),
    ],
)
def test_a_parameter_that_cannot_be_is_refused_where_it_is_defined(wrong, said):
    with pytest.raises(ConfigError, match=re.escape(said)) as caught:
        parameter(**{**RIGHT, **wrong})
    assert "force" in str(caught.value)


def test_a_parameter_with_a_negative_range_may_be_negative_and_another_one_may_not():
    assert Windy(-3.0).force == -3.0
    assert parameters_of(Windy)["force"].least == -inf
    known = make_dataclass("Positive", [("force", float, parameter(**RIGHT))], bases=(Windy,), frozen=True)
    with pytest.raises(ConfigError, match=r"must lie within \[0, inf\); found -1"):
        known(-1.0)


def test_a_neutral_value_without_bound_can_be_taken():
    limit = make_dataclass(
        "Limit", [("force", float, parameter(**{**RIGHT, "neutral": inf}))], bases=(Windy,), frozen=True
    )
    assert limit(inf).force == inf


def test_settings_reach_as_far_as_the_effect_takes_values_and_no_farther():
    share = parameter("share", "", (-0.5, 0.5), start=0.1, value=0.1, least=-1.0, below=1.0).metadata["parameter"]
    kind = accepted(share, 1.0)
    assert kind.range == "-1 to below 1"
    assert kind.takes(-1.0) and kind.takes(0.999) and not kind.takes(1.0) and not kind.takes(-1.001)
    assert accepted(parameter(**RIGHT).metadata["parameter"], 1.0).range == "0 to 50"


def without(*names, **others):
    """A class as `Windy` with some of what it says left out or said otherwise."""
    own = {name: value for name, value in vars(Windy).items() if not name.startswith("__") and name != "force"}
    said = {name: value for name, value in {**own, **others}.items() if name not in names}
    made = type("Windy", (OutsideEffect,), {**MINE, "__annotations__": {"force": float}, "force": force(), **said})
    made.__doc__ = None if "__doc__" in names else "A wind."
    return dataclass(frozen=True)(made)


def force():
    return parameter("force", "N", (-5.0, 5.0), start=1.0, value=2.0)


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        (lambda: without("push"), "it lacks the method push(force, at) of OutsideEffect."),
        (lambda: without(push=lambda self, force: force), "its method push(force) takes other arguments than push("),
        (lambda: without("reference"), "it does not say its reference. Add `reference = "),
        (lambda: without("is_linear"), "it does not say its is_linear. Add `is_linear = True` or False"),
        (lambda: without(is_linear="no"), "its is_linear is 'no'; expected is `is_linear"),
        (lambda: without(place="JOINT"), "its place is 'JOINT'; expected is `place = Place.<name>`"),
        (lambda: without("__doc__"), "it has no docstring"),
        (lambda: without(nearly_same_as="dead_zone"), "brackets with a comma: `('dead_zone',)`"),
        (lambda: without(same_as=["dead_zone"]), "its same_as is ['dead_zone']; expected are names of effects"),
        (lambda: without(never_beside="dead_zone"), "its never_beside is the text"),
        (lambda: without(acts_on=(DriverEffect,)), "its acts_on is (<class"),
        (lambda: type("Bare", (OutsideEffect,), MINE), "put @register above @dataclass(frozen=True)"),
        (lambda: dataclass(type("Soft", (OutsideEffect,), MINE)), "it is not frozen: write @dataclass(frozen=True)"),
        (lambda: dataclass(frozen=True)(type("Other", (), MINE)), "it is not derived from a class of twbal/effects/"),
        (
            lambda: without(size=field(default=1.0), __annotations__={"force": float, "size": float}),
            "its field size is not known as a parameter: write `size: float = parameter(",
        ),
        (
            lambda: without(force=parameter(**{**RIGHT, "start": 0.0})),
            "start equals neutral in each of its parameters",
        ),
    ],
)
def test_a_definition_that_is_not_complete_or_not_right_says_what_to_write(kind, said):
    with pytest.raises(ConfigError, match=re.escape(said)) as caught:
        library.register(kind())
    assert str(caught.value).startswith("The effect ") and "test_definition.py" in str(caught.value)


def test_an_actuator_without_a_place_is_told_which_there_are():
    class Slow(ActuatorEffect):
        """Slow."""

        reference, is_linear, separate_by = "Nobody, 1999.", False, "Look."

        def start(self, physics_step, rng):
            """Nothing."""

    with pytest.raises(ConfigError, match=r"its place\. Add `place = Place\.<name>`.* BODY, LINK, COMMAND, DRIVER"):
        library.register(dataclass(frozen=True)(Slow))


def test_an_effect_on_the_command_acts_at_the_driver_unless_it_says_otherwise():
    assert DriverEffect.place is Place.DRIVER
    assert library.all_effects()["torque_gain"].place is Place.GEAR


@pytest.mark.parametrize("word", ["same_as", "nearly_same_as", "never_beside", "acts_on"])
@pytest.mark.parametrize(("name", "said"), [("dead_zon", "'dead_zon', which is no effect"), ("windy", "itself")])
def test_names_of_other_effects_are_those_of_effects(word, name, said):
    library.register(without(**{word: ("backlash", name)}))
    with pytest.raises(ConfigError, match=rf"Windy .*its {word} names {said}.*coulomb_friction, dead_zone"):
        library.all_effects()


def test_a_file_of_the_package_is_held_to_the_same(tmp_path, monkeypatch):
    text = MODULE.replace("@register\n", "").replace('    reference = "Nobody, 1999."\n', "")
    (tmp_path / "half_way.py").write_text(text)
    monkeypatch.setattr(twbal.effects, "__path__", [*twbal.effects.__path__, str(tmp_path)])
    library._built_in.cache_clear()
    try:
        with pytest.raises(ConfigError, match=r"HalfWay of .*half_way\.py .*it does not say its reference"):
            library.all_effects()
    finally:
        library._built_in.cache_clear()
        del sys.modules["twbal.effects.half_way"]


def test_effects_from_outside_may_name_each_other():
    library.register(without(nearly_same_as=("gusty",)))
    other = without(nearly_same_as=("windy",))
    other.__name__ = other.__qualname__ = "Gusty"
    library.register(other)
    assert {"windy", "gusty"} <= set(library.all_effects())


@pytest.fixture
def said_of(as_from_a_shell, tmp_path, monkeypatch, capfd):
    """What a command says of a module that TWBAL_EFFECTS names."""
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("TWBAL_EFFECTS", "half_way")
    library._load_from_outside.cache_clear()

    def run(text, *words, status=1):
        (tmp_path / "half_way.py").write_text(text)
        assert main(["sim-collect", *words, "--cfg", "job"]) == status
        found = capfd.readouterr()
        lines = [line for line in found.err.splitlines() if "pybullet build time" not in line]
        assert len(lines) == (status != 0), found.err
        return lines[0] if lines else found.out

    yield run
    sys.modules.pop("half_way", None)
    library._load_from_outside.cache_clear()


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ('"share", "", (', '"share", (', "line 13: TypeError: parameter() missing 1 required positional argument"),
        ("(0.1, 1.0)", "1.0", "line 13: The parameter 'share' has prior=1.0; expected is the range"),
        (", value=0.5", "", "line 13: TypeError: parameter() missing 1 required keyword-only argument: 'value'"),
        ("import register", "import registr", "line 4: ImportError: cannot import name 'registr'"),
        ("from dataclasses", "import no_such\nfrom dataclasses", "line 2: ModuleNotFoundError: No module named 'no_s"),
        ("def drive(self, torque: float, time: float)", "def drive(self, torque)", "takes other arguments than drive("),
        (
            "    is_linear = False",
            "    size: float = 1.0\n    is_linear = False",
            "its field size is not known as a par",
        ),
        ("return self", "return (self", "line 20: SyntaxError: '(' was never closed"),
    ],
)
def test_a_module_that_cannot_be_imported_is_one_line_with_its_file_and_line(before, after, said, said_of):
    assert before in MODULE
    message = said_of(MODULE.replace(before, after))
    assert "The module 'half_way', which TWBAL_EFFECTS names, cannot be imported: " in message
    assert "half_way.py, line " in message and said in message


def test_a_module_that_is_not_there_is_told_with_the_path(said_of, monkeypatch):
    monkeypatch.setenv("TWBAL_EFFECTS", "no_such_module")
    assert "No module named 'no_such_module'. Is its folder in PYTHONPATH?" in said_of(MODULE)


def test_a_misspelt_parameter_is_told_with_those_that_the_effect_has(said_of):
    chosen = "+effect@sim.effects.half_way=half_way"
    message = said_of(MODULE, chosen, "sim.effects.half_way.shar=1")
    assert "The effect half_way has no parameter 'shar' (did you mean 'share'?). Its parameters are: share." in message


def test_a_file_with_an_effect_that_is_not_known_tells_of_the_variable(said_of, tmp_path, monkeypatch):
    monkeypatch.delenv("TWBAL_EFFECTS")
    (tmp_path / "mine.yaml").write_text("effects: {some_wind: {force: 1.0}}")
    assert "If it is one of your own, name its module in TWBAL_EFFECTS." in said_of(MODULE, "sim=mine.yaml")
