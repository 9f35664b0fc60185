"""Numbers with a decimal comma, with and without a unit, are told from lists."""

import pytest

from twbal.cli.settings.comma_number import is_comma_number


@pytest.mark.parametrize("text", ["0,9", "-1,09e-3", "1,09 kg", "5,2 kg cm", "3,4 N m measured; scale"])
def test_a_number_with_a_decimal_comma_is_one_also_with_a_unit(text):
    assert is_comma_number(text)


@pytest.mark.parametrize("value", ["1.09 kg", "1,2,3", "1,a", "1,2 3", "1,09 kg,2 kg", "kg", 0.9, [0, 9]])
def test_lists_and_others_are_none(value):
    assert not is_comma_number(value)
