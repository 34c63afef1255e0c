"""Chains of the boundary that are monotone across the transects, and the critical vertices between them.

Vertices are ordered lexicographically by (u, v). That is the order of their abscissae after an infinitesimal
shear u + epsilon v (simulation of simplicity: Edelsbrunner and Muecke 1990), under which no two vertices
share an abscissa and no edge is upright; so equal abscissae and shores along the transects are no special cases.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

import numpy as np

from oxbow.arrays import FloatArray, Indices, Mask
from oxbow.geometry.sweep import to_sweep
from oxbow_decomposition.boundary import distinct

__all__ = ["Chain", "Extreme", "Mark", "extremes"]

GRID_BITS = 44
"""Abscissae are compared in steps of 2^-44 of the site's extent, a few hundred times the noise of the rotation.

So a straight shore along the transects is upright, not a saw of critical points; no vertex is moved.
"""

SHORTEST_EDGE = 16.0
"""Vertices within this many steps of the one before count as repeating it: the turn at such an edge is noise."""

TURN_ERROR = 4.0 * 2.0**-53
"""Bound of the relative rounding error of a turn in floating point (Shewchuk 1997, section 4.1)."""


@dataclass(frozen=True, slots=True)
class Mark:
    """A place (u, v) on a chain, before its vertices from `index` on; `column` is u rounded for comparison."""

    column: float
    u: float
    v: float
    index: int


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """Vertices in the order of (column, v).

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        The vertices in the sweep frame; n >= 2.
    columns : ndarray, shape (n,)
        Their u as it is compared: rounded, non-decreasing.
    """

    points: FloatArray
    columns: FloatArray

    def mark(self, index: int) -> Mark:
        """The mark at one of the chain's vertices."""
        u, v = self.points[index].tolist()
        return Mark(float(self.columns[index]), u, v, index)

    @property
    def first(self) -> Mark:
        """Where the chain begins: its least u."""
        return self.mark(0)

    @property
    def last(self) -> Mark:
        """Where the chain ends: its greatest u."""
        return self.mark(len(self.points) - 1)

    def cut_below(self, vertex: Mark) -> Mark:
        """Where the chain is cut below a vertex: an upright edge in the vertex's column comes before the cut."""
        return self._cut(vertex, int(self.columns.searchsorted(vertex.column, side="right")))

    def cut_above(self, vertex: Mark) -> Mark:
        """Where the chain is cut above a vertex: an upright edge in the vertex's column comes after the cut."""
        return self._cut(vertex, int(self.columns.searchsorted(vertex.column, side="left")))

    def _cut(self, vertex: Mark, index: int) -> Mark:
        before, after = max(index - 1, 0), min(index, len(self.points) - 1)
        (u0, v0), (u1, v1) = self.points[before].tolist(), self.points[after].tolist()
        if vertex.column <= self.columns[before]:
            v = v0
        elif vertex.column >= self.columns[after]:
            v = v1
        else:
            v = v0 + min(max((vertex.u - u0) / (u1 - u0), 0.0), 1.0) * (v1 - v0)
        return Mark(vertex.column, vertex.u, v, index)

    def between(self, start: Mark, end: Mark) -> FloatArray:
        """The part of the chain from one mark to another, shape (n, 2), u non-decreasing, no point repeated.

        Parameters
        ----------
        start, end
            Places on this chain, in its order.

        Returns
        -------
        ndarray, shape (n, 2)
            In the sweep frame, in metres.
        """
        inner = self.points[start.index : end.index]
        points = np.concatenate([[(start.u, start.v)], inner, [(end.u, end.v)]])
        # Vertices are ordered by rounded u; their own u may be out of order by less than a step of the grid.
        points[:, 0] = np.clip(np.maximum.accumulate(points[:, 0]), start.u, end.u)
        return distinct(points)


@dataclass(frozen=True, slots=True)
class Extreme:
    """A vertex at which two chains begin (a minimum) or end.

    `floor` has water above it, `ceiling` has water below it. `opens` is whether the water at a minimum lies
    between the two (an open), not around them (a split). What a maximum does shows only in the sweep.
    """

    place: Mark
    floor: Chain
    ceiling: Chain
    minimum: bool
    opens: bool

    @property
    def order(self) -> tuple[float, float, bool, bool, float]:
        """Lexicographic; at one place ends, then splits, then opens from the lowest upwards."""
        (u0, v0), (u1, v1) = self.floor.points[:2].tolist()
        slope = math.atan2(v1 - v0, u1 - u0) if self.opens else 0.0
        return self.place.column, self.place.v, self.minimum, self.opens, slope


def extremes(walks: list[FloatArray], heading_rad: float) -> list[Extreme]:
    """The critical vertices of a boundary, in the order in which the sweep line meets them.

    Parameters
    ----------
    walks : list of ndarray, shape (n, 2)
        Closed planar walks along the boundary with the water on their left (`boundary_walks`).
    heading_rad
        Direction of the transects, clockwise from north.

    Returns
    -------
    list of Extreme
        In the order of the sweep, with chains in the sweep frame.
    """
    # A power of two, so that rounding to it is exact, and the same for every heading of a site.
    grid = 2.0 ** (math.frexp(max(float(np.abs(walk).max()) for walk in walks))[1] - GRID_BITS)
    found = [extreme for walk in walks for extreme in _of_walk(walk, heading_rad, grid)]
    return sorted(found, key=lambda extreme: extreme.order)


def _of_walk(planar: FloatArray, heading_rad: float, grid: float) -> Iterator[Extreme]:
    points = to_sweep(planar, heading_rad)
    compared = np.column_stack([np.round(points[:, 0] / grid) * grid, points[:, 1]])
    new = (np.abs(compared - np.roll(compared, 1, axis=0)) > SHORTEST_EDGE * grid).any(axis=1)
    planar, points, compared = planar[new], points[new], compared[new]

    rising = _rising(compared)
    ends = np.flatnonzero(rising != np.roll(rising, 1))
    # Minima and maxima alternate; the first is to be a minimum, from which a floor rises.
    ends = ends if rising[ends[0]] else np.roll(ends, 1)
    # Where rounding has put three vertices in line, the planar ones decide, which no rotation has touched.
    turns = _turns(compared, ends[::2])
    turns = np.where(turns == 0, _turns(planar, ends[::2]), turns)

    def chain(start: int, end: int) -> Chain:
        run = np.arange(start, end + 1 if start < end else end + len(planar) + 1) % len(planar)
        run = run if rising[start] else run[::-1]
        return Chain(points[run], compared[run, 0])

    chains = [chain(start, end) for start, end in pairwise([*ends.tolist(), int(ends[0])])]
    floors, ceilings = chains[::2], chains[1::2]
    for floor, ceiling, turn in zip(floors, [ceilings[-1], *ceilings[:-1]], turns.tolist(), strict=True):
        yield Extreme(place=floor.first, floor=floor, ceiling=ceiling, minimum=True, opens=turn > 0)
    for floor, ceiling in zip(floors, ceilings, strict=True):
        yield Extreme(place=floor.last, floor=floor, ceiling=ceiling, minimum=False, opens=False)


def _rising(vertices: FloatArray) -> Mask:
    """Whether each vertex of a closed walk is followed by one that comes after it in the sweep."""
    (u, v), (next_u, next_v) = vertices.T, np.roll(vertices, -1, axis=0).T
    rising: Mask = (u < next_u) | ((u == next_u) & (v < next_v))
    return rising


def _turns(walk: FloatArray, corners: Indices) -> FloatArray:
    """Turn of a walk at some of its vertices: positive to the left, and of the exact sign."""
    corner = walk[corners]
    behind, ahead = walk[corners - 1], walk[(corners + 1) % len(walk)]
    (x0, y0), (x1, y1) = (corner - behind).T, (ahead - corner).T
    turns: FloatArray = x0 * y1 - y0 * x1
    # Exact arithmetic for the few turns whose sign rounding could change: a wrong one opens a cell on land.
    doubtful = np.abs(turns) <= TURN_ERROR * (np.abs(x0 * y1) + np.abs(y0 * x1))
    for number in np.flatnonzero(doubtful):
        (ax, ay), (bx, by), (cx, cy) = (map(Fraction, p[number].tolist()) for p in (behind, corner, ahead))
        turns[number] = float((bx - ax) * (cy - by) - (by - ay) * (cx - bx))
    return turns
