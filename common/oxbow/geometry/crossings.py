"""Where the edges of contours meet, found in bounded time and memory.

Two contours of n edges may cross n^2 times. Edges that never meet may still have bounding boxes that do, and an
index knows only boxes. A drawn or surveyed contour has a few crossings and a few such pairs per edge.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely import Polygon, STRtree
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray, Geometries, Indices, Mask, Place

__all__ = ["MOST_PAIRS", "Edges", "TooManyPairs", "is_valid", "self_contact"]

MOST_PAIRS = 50_000_000
"""The most pairs of edges with boxes that meet, in contours checked together; shores have some four per edge."""
_SAMPLE = 512
"""How many edges are sampled to estimate the number of pairs; all, where there are fewer."""
_BLOCK = 8
"""Successive edges that are looked up together: neighbours are found in the same place of the index."""
_PAIRS_AT_ONCE = 2_000_000


class TooManyPairs(Exception):
    """The edges have more than `MOST_PAIRS` pairs whose boxes meet."""


def self_contact(polygon: Polygon) -> Place | None:
    """A place where a polygon without holes meets itself; None where it does not.

    Raises
    ------
    TooManyPairs
        It cannot be decided in bounded time.
    """
    # The sample first: where crossings are many it finds one at once, and GEOS would look at all of them.
    for contact in _sampled_contacts(polygon):
        return float(contact[0]), float(contact[1])
    if _is_valid(polygon):
        return None
    # GEOS reports the place in the text of the reason only.
    x, y = map(float, re.findall(r"\[(\S+) (\S+)\]", shapely.is_valid_reason(polygon))[0])
    return x, y


def is_valid(geometry: BaseGeometry) -> bool:
    """Whether polygons are valid.

    Raises
    ------
    TooManyPairs
        It cannot be decided in bounded time.
    """
    return next(_sampled_contacts(geometry), None) is None and _is_valid(geometry)


def _is_valid(geometry: BaseGeometry) -> bool:
    # Not the property, which holds the interpreter's lock as long as it lasts: seconds for a slanted comb of 4000
    # teeth.
    return bool(shapely.is_valid(geometry))


def _sampled_contacts(geometry: BaseGeometry) -> Iterator[FloatArray]:
    """Places where a sample of a geometry's edges meets others of the same ring; nothing where edges are few."""
    # So few edges cannot have too many pairs, whatever their shape: GEOS decides in bounded time.
    if int(shapely.get_num_coordinates(geometry)) ** 2 <= MOST_PAIRS:
        return
    edges = Edges.of(shapely.get_parts([geometry]))
    for pairs in edges.meetings(sample=_SAMPLE):
        yield from edges.contacts(pairs[edges.ring[pairs[:, 0]] == edges.ring[pairs[:, 1]]])


@dataclass(frozen=True)
class Edges:
    """The edges of polygons.

    Parameters
    ----------
    ends : ndarray of shape (edges, 2, 2)
        Both ends of each edge.
    ring : ndarray of shape (edges,)
        The ring that each edge belongs to; of polygons without holes, the polygon.
    """

    ends: FloatArray
    ring: Indices

    @classmethod
    def of(cls, polygons: Geometries) -> Edges:
        """All edges, ring by ring."""
        points, ring = shapely.get_coordinates(shapely.get_rings(polygons), return_index=True)
        inside = ring[1:] == ring[:-1]
        return cls(np.stack([points[:-1], points[1:]], axis=1)[inside], ring[:-1][inside])

    def __len__(self) -> int:
        return len(self.ends)

    def where(self, chosen: Mask) -> Edges:
        """Some of the edges."""
        return Edges(self.ends[chosen], self.ring[chosen])

    def within(self, box: FloatArray) -> Mask:
        """Which edges have a box that meets a box, given as least and greatest x and y."""
        low, high = self.ends.min(axis=1), self.ends.max(axis=1)
        meets: Mask = ((low <= box[2:]) & (high >= box[:2])).all(axis=1)
        return meets

    @cached_property
    def _lines(self) -> Geometries:
        return np.asarray(shapely.linestrings(self.ends))

    def meetings(self, of: Mask | None = None, *, sample: int | None = None) -> Iterator[Indices]:
        """Pairs of edges that meet inside at least one of the two, shape (pairs, 2), part by part.

        Edges that merely share an end, as neighbours in a ring do, do not count as meeting, nor do equal edges, as
        on a border that two polygons share. The order of the parts is shuffled, always in the same way, so that a
        crossing among many is found at once.

        Parameters
        ----------
        of
            Each pair contains at least one of these edges; by default, any edges.
        sample
            Look for the meetings of only this many edges; by default, of all.

        Returns
        -------
        iterator of ndarray of int, shape (pairs, 2)
            Indices of the edges; of two that were both looked up, each pair comes once. Parts may be empty.

        Raises
        ------
        TooManyPairs
            As soon as a sample shows that more than `MOST_PAIRS` would have to be checked.
        """
        order = _shuffled(np.arange(len(self)) if of is None else np.flatnonzero(of))
        looked_up = np.zeros(len(self), dtype=bool)
        looked_up[order[:sample]] = True
        tree = STRtree(self._lines)
        begin, pairs, size = 0, 0, 1
        while begin < min(len(order), sample or len(order)):
            queried = order[:sample][begin : begin + size]
            first, second = tree.query(self._lines[queried])
            first = queried[first]
            begin, pairs = begin + len(queried), pairs + len(first)
            # Two edges that are both looked up find each other twice; the pair counts once.
            fresh = (first < second) | ~looked_up[second]
            yield self._meeting(first[fresh], second[fresh])
            # An estimate from what was looked up so far, judged against a full sample before it is believed.
            if pairs * len(order) > MOST_PAIRS * max(begin, min(_SAMPLE, len(order))):
                raise TooManyPairs
            # Each edge finds itself, so pairs > 0. At most doubled: a dense part may follow a sparse one.
            size = int(np.clip(_PAIRS_AT_ONCE * begin / pairs, 1, 2 * size))

    def contacts(self, pairs: Indices) -> FloatArray:
        """Where pairs of edges meet, shape (n, 2), in the order of the edges; not where it is only rounding."""
        # Sorted, so that an error names the same place in whatever order pairs were found.
        pairs = pairs[np.lexsort(pairs.T[::-1])]
        both = shapely.intersection(self._lines[pairs[:, 0]], self._lines[pairs[:, 1]])
        coordinates, owner = shapely.get_coordinates(both, return_index=True)
        return coordinates[np.unique(owner, return_index=True)[1]]

    def _meeting(self, first: Indices, second: Indices) -> Indices:
        """The pairs of edges that meet inside at least one of the two."""
        a, b = self.ends[first].swapaxes(0, 1)
        c, d = self.ends[second].swapaxes(0, 1)
        sides = _side(a, b, c), _side(a, b, d), _side(c, d, a), _side(c, d, b)
        meet = (sides[0] * sides[1] < 0) & (sides[2] * sides[3] < 0)
        for side, point, start, end in zip(sides, (c, d, a, b), (a, a, c, c), (b, b, d, d), strict=True):
            meet |= (side == 0) & _between(point, start, end)
        return np.column_stack([first[meet], second[meet]])


def _side(start: FloatArray, end: FloatArray, point: FloatArray) -> FloatArray:
    """On which side of each edge a point lies: 1, -1, or 0 where it lies on its line."""
    along, away = end - start, point - start
    # The sign alone: products of the areas of tiny edges would underflow to 0.
    return np.sign(along[:, 0] * away[:, 1] - along[:, 1] * away[:, 0])


def _between(point: FloatArray, start: FloatArray, end: FloatArray) -> Mask:
    """Whether a point on an edge's line lies strictly between its ends."""
    along = end - start
    at = ((point - start) * along).sum(axis=1)
    inside: Mask = (at > 0) & (at < (along * along).sum(axis=1))
    return inside


def _shuffled(indices: Indices) -> Indices:
    """Indices in another order, the same each time: short runs stay together."""
    starts = np.arange(0, len(indices), _BLOCK)
    runs = np.random.default_rng(0).permutation(starts)[:, None] + np.arange(_BLOCK)
    return indices[runs[runs < len(indices)]]
