"""Which places of the water see each other: by the shore's sides about the lines between them.

A line between two places stays in the water if it meets no shore but at its ends, and an end or else its middle
lies inside. That is arithmetic on the few sides whose boxes the line's box meets. Only lines that graze the shore
are left to the exact predicate, which takes ten times as long.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import shapely
from shapely import Polygon, STRtree

from oxbow.arrays import FloatArray, Geometries, Indices, Mask
from oxbow.geometry.triangles import cross

__all__ = ["Sight"]

IN_LINE = 1e-12
"""Sine of the angle below which two directions may be one: three thousand times what rounding makes of it."""


class Sight:
    """Sight across a polygon of water (prepared)."""

    def __init__(self, free: Polygon) -> None:
        self._free = free

    def along(self, places: FloatArray, pairs: Indices, lines: Geometries) -> Mask:
        """Whether straight lines between places stay in the water.

        Parameters
        ----------
        places
            Shape (m, 2), in metres, in the water or on its shore.
        pairs
            Numbers of the places that each line joins, shape (n, 2).
        lines
            The lines themselves, shape (n,).

        Returns
        -------
        ndarray of bool, shape (n,)
        """
        begins, ends = places[pairs[:, 0]], places[pairs[:, 1]]
        line, side = self._index.query(lines)
        a, b = self._sides[side, 0], self._sides[side, 1]
        meets, crosses = _meetings(begins[line], ends[line], a, b)
        is_inside = np.logical_or(*shapely.contains_xy(self._free, places)[pairs].T)
        # From shore to shore neither end lies inside, and the middle decides between a chord of the water and one
        # of land.
        from_shore = np.flatnonzero(~is_inside)
        is_inside[from_shore] = shapely.contains_xy(self._free, (begins[from_shore] + ends[from_shore]) / 2)
        crossing, unsure = np.zeros((2, len(pairs)), dtype=bool)
        crossing[line[crosses]] = True
        unsure[line[meets]] = True
        seen = is_inside & ~crossing
        left = np.flatnonzero(unsure & ~crossing)
        seen[left] = shapely.covers(self._free, lines[left])
        return np.asarray(seen)

    @cached_property
    def _sides(self) -> FloatArray:
        """The sides of the shore, shape (k, 2, 2)."""
        nodes, ring = shapely.get_coordinates(shapely.get_rings(self._free), return_index=True)
        follows = ring[1:] == ring[:-1]
        return np.stack([nodes[:-1][follows], nodes[1:][follows]], axis=1)

    @cached_property
    def _index(self) -> STRtree:
        return STRtree(np.asarray(shapely.linestrings(self._sides)))


def _meetings(p: FloatArray, q: FloatArray, a: FloatArray, b: FloatArray) -> tuple[Mask, Mask]:
    """Whether lines p-q may meet sides a-b elsewhere than in an end that they share, and whether they cross."""
    to_a, to_b = _turn(p, q, a), _turn(p, q, b)
    to_p, to_q = _turn(a, b, p), _turn(a, b, q)
    apart = (to_a * to_b > 0) | (to_p * to_q > 0)
    crosses = (to_a * to_b < 0) & (to_p * to_q < 0)
    shares = np.zeros(len(p), dtype=bool)
    for end, other_turn in ((a, to_b), (b, to_a)):
        same = (end == p).all(axis=1) | (end == q).all(axis=1)
        shares |= same & (other_turn != 0)
    return ~apart & ~shares, crosses


def _turn(start: FloatArray, end: FloatArray, place: FloatArray) -> FloatArray:
    """1 where places lie to the left of lines, -1 to the right, 0 in line with them up to rounding."""
    ahead, aside = end - start, place - start
    sine = cross(ahead, aside)
    slack = IN_LINE * np.hypot(*ahead.T) * np.hypot(*aside.T)
    return np.where(np.abs(sine) <= slack, 0.0, np.sign(sine))
