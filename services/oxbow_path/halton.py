"""The Halton sequence in the plane: places of low discrepancy in the unit square (Halton 1960).

`scipy.stats.qmc.Halton` gives the same numbers, bit for bit. Importing it takes a quarter of a second and 30 MB,
far more than drawing does.
"""

from __future__ import annotations

import math

import numpy as np

from oxbow.arrays import FloatArray, Indices

__all__ = ["halton", "scrambled_halton"]

_BASES = (2, 3)


def halton(count: int) -> FloatArray:
    """The first points of the sequence, from (0, 0) on; shape (count, 2), each coordinate in [0, 1)."""
    return np.column_stack([_radical_inverse(count, _unscrambled(base)) for base in _BASES])


def scrambled_halton(count: int, generator: np.random.Generator) -> FloatArray:
    """The first points of the sequence with its digits permuted at random (Owen 2017, Algorithm 1).

    Parameters
    ----------
    count
        How many points, at least 0.
    generator
        A child of it is spawned for the permutations: its own numbers stay those that would have come.

    Returns
    -------
    ndarray, shape (count, 2)
        Each coordinate in [0, 1).
    """
    child = generator.spawn(1)[0]
    # All permutations of one base before those of the next, as they are drawn one after another.
    digits = [_unscrambled(base) for base in _BASES]
    for permutation in (row for rows in digits for row in rows):
        child.shuffle(permutation)
    return np.column_stack([_radical_inverse(count, rows) for rows in digits])


def _unscrambled(base: int) -> Indices:
    """What stands for each digit, one row for each place behind the point that double precision can hold."""
    places = math.ceil(54 / math.log2(base)) - 1
    return np.tile(np.arange(base), (places, 1))


def _radical_inverse(count: int, digits: Indices) -> FloatArray:
    """The numbers from 0 to `count` - 1, their digits replaced and mirrored at the point (van der Corput 1935)."""
    base = digits.shape[1]
    rest, largest = np.arange(count), count - 1
    mirrored, value = np.zeros(count), 1.0
    for row in digits:
        value /= base
        # Leading zeros count too, since one may stand for another digit; there they are the same for all numbers.
        rest, digit = np.divmod(rest, base) if largest > 0 else (rest, 0)
        largest //= base
        mirrored += row[digit] * value
    return mirrored
