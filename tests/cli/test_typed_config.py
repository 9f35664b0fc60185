"""The text that says with which settings a result was made."""

import pytest
from omegaconf import MissingMandatoryValue, OmegaConf

from twbal.cli.typed_config import recorded

ODD = ["1e3", "-2E-7", "007", "1_000", "0x10", "1:30", "true", "No", "null", "~", "", " a", "2026-11-27", "ä: b # c"]
ODD += ["*x", "'", '"', "- a", "a\nb", "!tag", "@", "%", "[a]", "{a: b}", "1.0", ".5", ".inf", "x" * 200]


@pytest.mark.parametrize("text", ODD)
def test_every_text_reads_back_as_that_text(text):
    cfg = OmegaConf.create({"value": text, "list": [text], text or "empty": 1})
    assert OmegaConf.create(recorded(cfg, ())) == cfg


@pytest.mark.parametrize("number", [0, -3, 1e-6, 1e22, 0.1, 2.0, float("inf"), True, None])
def test_every_number_reads_back_as_that_number(number):
    (read,) = OmegaConf.create(recorded(OmegaConf.create({"value": number}), ())).values()
    assert (read, type(read)) == (number, type(number))


def test_what_bears_on_no_result_is_left_out_and_interpolations_are_resolved():
    cfg = OmegaConf.create({"b": {"c": 1, "d": "${a}"}, "a": 2, "port": "x", "same": [1, 1]})
    assert recorded(cfg, ("port", "b.c", "b.none", "none.c", "a.none")) == "a: 2\nb:\n  d: 2\nsame:\n- 1\n- 1\n"
    assert cfg.port == "x"


def test_a_value_that_was_not_given_is_named():
    with pytest.raises(MissingMandatoryValue, match=r"b\.c"):
        recorded(OmegaConf.create({"b": {"c": "???"}}), ())
    with pytest.raises(MissingMandatoryValue, match=r"b\[1\]"):
        recorded(OmegaConf.create({"b": [1, "???"]}), ())
    assert recorded(OmegaConf.create({"b": "what???", "c": "???"}), ("c",)) == "b: what???\n"


def test_one_list_in_two_places_is_written_twice():
    shared = OmegaConf.create({"a": [1, 2], "b": "${a}"})
    assert recorded(shared, ()) == "a:\n- 1\n- 2\nb:\n- 1\n- 2\n"
