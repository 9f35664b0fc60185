from math import comb, factorial, prod

import numpy as np
import pytest

from twbal.models.moments.multi_index import multi_indices

SIZES = pytest.mark.parametrize(("dimension", "degree"), [(1, 0), (1, 6), (2, 3), (4, 8), (6, 4)])


@SIZES
def test_every_index_of_the_degree_is_there_once_lowest_degree_first(dimension, degree):
    table = multi_indices(dimension, degree)
    degrees = table.powers.sum(axis=1)
    assert len(table.powers) == comb(degree + dimension, dimension)
    assert len({tuple(row) for row in table.powers}) == len(table.powers)
    assert (np.diff(degrees) >= 0).all()
    assert degrees.max() == degree
    for k in range(degree + 1):
        assert (degrees[table.first[k] : table.first[k + 1]] == k).all()
    assert table.first[degree + 1] == len(degrees)


@SIZES
def test_up_down_and_parent_step_by_one_power(dimension, degree):
    table = multi_indices(dimension, degree)
    for r, power in enumerate(table.powers):
        for k, one in enumerate(np.eye(dimension, dtype=int)):
            up, down = table.up[r, k], table.down[r, k]
            assert (up == -1) == (power.sum() == degree)
            assert (down == -1) == (power[k] == 0)
            assert up == -1 or np.array_equal(table.powers[up], power + one)
            assert down == -1 or np.array_equal(table.powers[down], power - one)
        assert table.parent[r] == (table.down[r, table.axis[r]] if r else -1)


@SIZES
def test_factorials_are_products_over_the_powers(dimension, degree):
    table = multi_indices(dimension, degree)
    assert table.factorial.tolist() == [prod(factorial(int(k)) for k in row) for row in table.powers]
