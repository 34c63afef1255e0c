"""Lengths of the shortest routes from a few places to very many."""

from __future__ import annotations

import numpy as np
from shapely import MultiPolygon, Polygon

from oxbow.arrays import FloatArray
from oxbow.geometry.route.mesh import Touches, WaterMesh
from oxbow.geometry.route.network import Ends
from oxbow.geometry.route.search import Arcs, cheapest_ways, distinct
from oxbow.geometry.route.sights import sights
from oxbow.geometry.route.visibility import VisibilityGraph

__all__ = ["lengths_from"]


def lengths_from(water: Polygon | MultiPolygon, sources: FloatArray, places: FloatArray) -> FloatArray:
    """Lengths of the shortest routes from some places to others.

    Only the lines of sight from sources and bends are computed, unlike in `Router.distances`, which needs them
    between every two places.

    Parameters
    ----------
    water
        Where routes may run.
    sources, places : ndarray, shape (k, 2) and (n, 2)
        In the water, in metres; no route leads to a place outside.

    Returns
    -------
    ndarray, shape (k, n)
        In metres; inf where no route leads.

    Raises
    ------
    Infeasible
        A source lies outside the water; `where` is ``sources[k]``.
    """
    graph = VisibilityGraph(WaterMesh.of(water))
    mesh, bends = graph.mesh, graph.bends
    ends = Ends(sources, mesh.touches(sources, [f"sources[{number}]" for number in range(len(sources))]))
    links, first = graph.links(ends), len(bends.places)
    eyes = np.vstack([bends.places, sources])
    departures = Arcs.one_way(eyes, *distinct(first + links.end, links.out), graph.danger)
    ways = cheapest_ways((graph.arcs + departures).graph(len(eyes)), first + np.arange(len(sources)))
    at = bends.touches + Touches(first + ends.at.place, ends.at.triangle)
    nothing = np.zeros(len(mesh.tails), dtype=np.bool_)
    seen = sights(mesh, eyes, at, places, mesh.holding(places), nothing)
    # The last bend or source of a shortest route sees the place itself: one straight step completes the route.
    onward_m = np.hypot(*(places[seen.places] - eyes[seen.place_eyes]).T)
    lengths_m = np.full((len(sources), len(places)), np.inf)
    for own_m, to_eyes_m in zip(lengths_m, ways.costs, strict=True):
        np.minimum.at(own_m, seen.places, to_eyes_m[seen.place_eyes] + onward_m)
    return lengths_m
