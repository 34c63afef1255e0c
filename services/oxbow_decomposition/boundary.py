"""The boundary of a polygon as closed walks with the water on their left."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
import shapely
from shapely import LinearRing, Polygon

from oxbow.arrays import FloatArray, Place

__all__ = ["boundary_walks", "distinct"]


@dataclass(frozen=True, slots=True, eq=False)
class _Arc:
    """A part of a ring from one pinch to the next (to itself where the ring has only one)."""

    points: FloatArray

    @property
    def tail(self) -> Place:
        x, y = self.points[0].tolist()
        return x, y

    @property
    def head(self) -> Place:
        x, y = self.points[-1].tolist()
        return x, y


def boundary_walks(polygon: Polygon) -> list[FloatArray]:
    """Closed walks along the boundary, with the polygon's interior on their left.

    A walk is what a vehicle traces that keeps the shore at an infinitesimal distance on its right. Where
    rings touch in a point (a hole on the border, two holes corner to corner), no water passes, and
    the walk goes on from one ring to the other; it comes back to that point once for each sector of water there.

    Parameters
    ----------
    polygon
        A valid polygon. Rings may touch one another in single points.

    Returns
    -------
    list of ndarray, shape (n, 2)
        The vertices of each walk; the first is not repeated at the end, no two consecutive ones are equal.
    """
    oriented = shapely.orient_polygons(polygon)
    rings = [oriented.exterior, *oriented.interiors]
    pinches = _pinches(rings)
    walks = [_vertices(ring) for number, ring in enumerate(rings) if number not in pinches]
    arcs = [arc for number, places in pinches.items() for arc in _arcs(_vertices(rings[number]), places)]
    return walks + _linked(arcs)


def _pinches(rings: list[LinearRing]) -> dict[int, list[FloatArray]]:
    """For each ring that touches others, by number: where."""
    pinches: dict[int, list[FloatArray]] = {}
    pairs = shapely.STRtree(rings).query(rings, predicate="intersects").T
    for one, other in pairs[pairs[:, 0] < pairs[:, 1]].tolist():
        places = list(shapely.get_coordinates(shapely.intersection(rings[one], rings[other])))
        pinches.setdefault(one, []).extend(places)
        pinches.setdefault(other, []).extend(places)
    return pinches


def distinct(points: FloatArray) -> FloatArray:
    """The points, shape (n, 2), without those that equal the one before them."""
    new = np.ones(len(points), dtype=np.bool_)
    new[1:] = (points[1:] != points[:-1]).any(axis=1)
    kept: FloatArray = points[new]
    return kept


def _vertices(ring: LinearRing) -> FloatArray:
    return distinct(shapely.get_coordinates(ring))[:-1]


def _arcs(ring: FloatArray, places: list[FloatArray]) -> list[_Arc]:
    """The ring cut at places on it, each of which is a vertex or lies on an edge."""
    for place in places:
        if not (ring == place).all(axis=1).any():
            ring = np.insert(ring, _nearest_edge(ring, place) + 1, place, axis=0)
    # Unique, since two rings may touch a third in one place.
    cuts = np.unique([np.flatnonzero((ring == place).all(axis=1))[0] for place in places])
    # From a cut to the next: no arc then runs over the end of the array.
    ring = np.roll(ring, -cuts[0], axis=0)
    bounds = [*(cuts - cuts[0]).tolist(), len(ring)]
    closed = np.concatenate([ring, ring[:1]])
    return [_Arc(closed[first : last + 1]) for first, last in pairwise(bounds)]


def _nearest_edge(ring: FloatArray, place: FloatArray) -> int:
    edges = shapely.linestrings(np.stack([ring, np.roll(ring, -1, axis=0)], axis=1))
    return int(np.argmin(shapely.distance(edges, shapely.Point(place))))


def _linked(arcs: list[_Arc]) -> list[FloatArray]:
    """Walks over all arcs: at each pinch on to the arc that bounds the same sector of water."""
    leaving: dict[Place, list[_Arc]] = {}
    for arc in arcs:
        leaving.setdefault(arc.tail, []).append(arc)
    ahead = {arc: min(leaving[arc.head], key=partial(_sector, arc)) for arc in arcs}
    walks = []
    while ahead:
        arc = next(iter(ahead))
        walk = []
        # A walk ends where it began: each arc is the successor of exactly one, so that the arcs form cycles.
        while arc in ahead:
            walk.append(arc.points[:-1])
            arc = ahead.pop(arc)
        walks.append(np.concatenate(walk))
    return walks


def _sector(behind: _Arc, ahead: _Arc) -> float:
    """Angle of the water between the end of one arc and the start of another: clockwise, in (0, 2 pi]."""
    back = behind.points[-2] - behind.points[-1]
    forth = ahead.points[1] - ahead.points[0]
    # Straight back is a full turn: an arc bounds no water of angle 0.
    turn = math.atan2(back[1], back[0]) - math.atan2(forth[1], forth[0])
    return turn % (2 * math.pi) or 2 * math.pi
