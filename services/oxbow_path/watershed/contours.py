"""The tree of depth contours: lines at equal distance from the shore, joined from the border to the core."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import networkx as nx
import numpy as np
import shapely
from shapely import LinearRing, LineString, Polygon

from oxbow.geometry.route.gate_routes import Routes
from oxbow_path.walk.region import Circuit

__all__ = ["contour_tree"]

DETAIL = 0.05
"""How far a contour may be moved to straighten it, in spacings."""

LEAST_AREA = 1.0
"""Parts of a level smaller than this many squared spacings of the path's legs are left to branches."""


@dataclass(frozen=True)
class _Part:
    """A connected piece of the water deeper than one level, and the pieces of the next level inside it."""

    area: Polygon
    inner: tuple[_Part, ...]

    @property
    def rings(self) -> tuple[LinearRing, ...]:
        """Its contours: the outer one, and those round islands."""
        return self.area.exterior, *self.area.interiors


def contour_tree(free: Polygon, routes: Routes, *, first_m: float, spacing_m: float) -> Circuit:
    """Contours of the distance to the shore, and the links that join them into one piece.

    The levels of the watershed (Balampanis, Maza and Ollero 2016, section V) are steps over triangles; here they
    are distances, so that the legs of the path stand evenly.

    Parameters
    ----------
    free
        The free space.
    routes
        Ways through it, where only water too narrow for a contour connects its levels.
    first_m
        Depth of the outermost contours.
    spacing_m
        Distance from one contour to the next.

    Returns
    -------
    Circuit
        The contours as transects, closed by a segment that they overlap by; links are the shortest possible.
    """
    roots = _parts(free, first_m, spacing_m)
    contours = [_closed(ring) for part in _all_parts(roots) for ring in part.rings]
    links = [*_links(roots), *_ways([root.area for root in roots], routes)]
    return Circuit(tuple(contours), tuple(links))


def _parts(area: Polygon, inwards_m: float, spacing_m: float) -> tuple[_Part, ...]:
    """The pieces that are left of an area eroded, largest first, each with those of the levels inside."""
    # Level from level, not from the shore: each buffer then works on few vertices. Simplified, since every erosion
    # adds arcs at each corner of an island.
    eroded = area.buffer(-inwards_m).simplify(DETAIL * spacing_m)
    pieces = shapely.get_parts(eroded)
    pieces = pieces[shapely.area(pieces) > LEAST_AREA * (spacing_m / 2) ** 2]
    pieces = pieces[np.argsort(-shapely.area(pieces), kind="stable")]
    return tuple(_Part(piece, _parts(piece, spacing_m, spacing_m)) for piece in pieces)


def _all_parts(parts: Sequence[_Part]) -> Iterator[_Part]:
    for part in parts:
        yield part
        yield from _all_parts(part.inner)


def _closed(ring: LinearRing) -> LineString:
    """The ring as a line that runs one segment past its start, so that flat ends leave no notch in its band."""
    points = shapely.get_coordinates(ring)
    return LineString(np.vstack([points, points[1]]))


def _links(roots: Sequence[_Part]) -> Iterator[LineString]:
    """The shortest lines that join the contours of every root, by Kruskal's rule.

    Candidates join contours of one piece and of those next inside it. The shortest line between two of these that
    crossed a third would be longer than the two to that third: so it is never taken, and no link leaves the piece.
    """
    graph: nx.Graph[LinearRing] = nx.Graph()
    for part in _all_parts(roots):
        family = [*part.rings, *(ring for inner in part.inner for ring in inner.rings)]
        # Reshaped for a family of one, which has no pairs.
        pairs = np.array(list(itertools.combinations(family, 2)), dtype=object).reshape(-1, 2)
        for (one, other), distance in zip(pairs, shapely.distance(*pairs.T), strict=True):
            graph.add_edge(one, other, weight=distance)
    for one, other in nx.minimum_spanning_edges(graph, data=False):
        yield shapely.shortest_line(one, other)


def _ways(areas: list[Polygon], routes: Routes) -> Iterator[LineString]:
    """Through narrows: from every area to the nearest of those already joined, by Prim's rule."""
    joined = np.array(areas[:1], dtype=object)
    left = np.array(areas[1:], dtype=object)
    while len(left):
        distance = shapely.distance(left[:, None], joined)
        one, other = np.unravel_index(np.argmin(distance), distance.shape)
        start = shapely.get_coordinates(shapely.shortest_line(left[one], joined[other]))[0]
        way = routes.to_area(start, joined[other], routes.goals_in(joined[other]))
        if way is not None:
            yield way
        joined, left = np.append(joined, left[one]), np.delete(left, one)
