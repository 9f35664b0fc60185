import numpy as np

from twbal.core.compiled import kernel
from twbal.core.cosine import cosine_of_turns


@kernel(is_kept=False)
def cosines(turns):
    found = np.empty(len(turns))
    for j in range(len(turns)):
        found[j] = cosine_of_turns(turns[j])
    return found


def test_it_is_the_cosine_to_the_last_digits():
    turns = np.concatenate([np.linspace(-3.0, 3.0, 6001), [0.25, -0.25, 0.5, -0.5, 1e3 + 0.125, -1e6 - 0.375]])
    whole = np.round(turns)  # taken off before it is multiplied by 2π, where it would cost digits
    expected = np.cos(2.0 * np.longdouble(np.pi) * (turns - whole).astype(np.longdouble))
    np.testing.assert_allclose(cosines(turns), expected.astype(float), rtol=0, atol=6e-16)
    np.testing.assert_array_equal(cosines(np.arange(-5.0, 6.0)), cosines(np.zeros(11)))
