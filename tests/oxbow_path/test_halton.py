"""The Halton sequence, against SciPy's."""

import numpy as np
import pytest
from scipy.stats import qmc

from oxbow_path.halton import halton, scrambled_halton

COUNTS = (0, 1, 2, 7, 1000)


@pytest.mark.parametrize("count", COUNTS)
def test_it_is_scipys_bit_for_bit(count):
    assert np.array_equal(halton(count), qmc.Halton(2, scramble=False).random(count))


@pytest.mark.parametrize("count", COUNTS)
def test_scrambled_it_is_scipys_and_leaves_the_generator_as_scipy_does(count):
    ours, theirs = np.random.default_rng(5), np.random.default_rng(5)
    # Twice from one generator, as for two cells: each sequence has permutations of its own.
    for _ in range(2):
        assert np.array_equal(scrambled_halton(count, ours), qmc.Halton(2, rng=theirs).random(count))
        assert np.array_equal(ours.random(3), theirs.random(3))
