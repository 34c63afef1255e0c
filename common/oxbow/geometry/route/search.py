"""Cheapest ways over a network of places (E. W. Dijkstra 1959, through SciPy)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra

from oxbow.arrays import FloatArray, Indices
from oxbow.geometry.route.danger import Danger

__all__ = ["Arcs", "Ways", "WaysTo", "cheapest_ways", "cheapest_ways_to", "distinct"]


@dataclass(frozen=True)
class Arcs:
    """One-way connections of numbered places, each pair at most once, with costs in metres."""

    tails: Indices
    heads: Indices
    costs: FloatArray

    @classmethod
    def one_way(cls, places: FloatArray, tails: Indices, heads: Indices, danger: Danger) -> Arcs:
        """Straight edges between places.

        Parameters
        ----------
        places : ndarray, shape (n, 2)
            In metres.
        tails, heads : ndarray of int, shape (m,)
            Numbers of the places where each edge begins and ends; no pair twice.
        danger
            What makes an edge cost more than its length.

        Returns
        -------
        Arcs
            In the order given.
        """
        return cls(tails, heads, danger.costs(places[tails], places[heads]))

    @classmethod
    def both_ways(cls, places: FloatArray, pairs: Indices, danger: Danger) -> Arcs:
        """Straight edges between pairs of places, there and back.

        Parameters
        ----------
        places : ndarray, shape (n, 2)
            In metres.
        pairs : ndarray of int, shape (m, 2)
            Numbers of the places that an edge joins. A pair may occur repeatedly and either way round; a pair of
            one place is left out.
        danger
            What makes an edge cost more than its length.

        Returns
        -------
        Arcs
            Two for each pair, however often it occurs; none from a place to itself.
        """
        low, high = distinct(pairs.min(axis=1), pairs.max(axis=1))
        low, high = low[low < high], high[low < high]
        return cls.one_way(places, np.concatenate([low, high]), np.concatenate([high, low]), danger)

    def graph(self, count: int) -> csr_array[np.float64]:
        """The graph over `count` places."""
        # A pair that occurred twice would have its costs added up: hence each pair at most once.
        return coo_array((self.costs, (self.tails, self.heads)), shape=(count, count)).tocsr()

    def __add__(self, other: Arcs) -> Arcs:
        return Arcs(
            np.concatenate([self.tails, other.tails]),
            np.concatenate([self.heads, other.heads]),
            np.concatenate([self.costs, other.costs]),
        )


@dataclass(frozen=True)
class Ways:
    """The cheapest ways from some sources to all places: their costs (inf where none leads), their last steps."""

    costs: FloatArray
    previous: Indices

    def way(self, source: int, place: int) -> list[int]:
        """The places on the way from a source to a place.

        Parameters
        ----------
        source
            The source's rank among the sources of the search.
        place
            The number of the place to arrive at.

        Returns
        -------
        list of int
            From the source to the place, both included; the place alone where none leads there.
        """
        return list(self._backwards(source, place))[::-1]

    def _backwards(self, source: int, place: int) -> Iterator[int]:
        while place >= 0:
            yield place
            place = int(self.previous[source, place])


def cheapest_ways(graph: csr_array[np.float64], sources: Indices) -> Ways:
    """Search a graph from some of its places.

    Parameters
    ----------
    graph
        `Arcs.graph`.
    sources : ndarray of int, shape (k,)
        Numbers of the places to start from.

    Returns
    -------
    Ways
        Costs and last steps, each of shape (k, n).
    """
    costs, previous = dijkstra(graph, indices=sources, return_predecessors=True)
    return Ways(costs, previous.astype(np.intp))


@dataclass(frozen=True)
class WaysTo:
    """The cheapest ways from all places to the nearest of some goals: costs (inf where none leads), next steps."""

    costs: FloatArray
    following: Indices

    def way(self, place: int) -> list[int]:
        """The places on the way from a place to its goal; both included."""
        way = [place]
        while (place := int(self.following[place])) >= 0:
            way.append(place)
        return way


def cheapest_ways_to(graph: csr_array[np.float64], goals: Indices) -> WaysTo:
    """Search a graph backwards, from its goals to all places: once, however many set out.

    Parameters
    ----------
    graph
        `Arcs.graph`.
    goals : ndarray of int, shape (k,)
        Numbers of the places of which the nearest counts.

    Returns
    -------
    WaysTo
        Costs and next steps, each of shape (n,).
    """
    # In the transposed graph, predecessors are the next steps towards a goal.
    costs, following, _ = dijkstra(graph.T.tocsr(), indices=goals, min_only=True, return_predecessors=True)
    return WaysTo(costs, following.astype(np.intp))


def distinct(tails: Indices, heads: Indices) -> tuple[Indices, Indices]:
    """Pairs of numbers, each once.

    Parameters
    ----------
    tails, heads : ndarray of int, shape (m,)
        Not negative.

    Returns
    -------
    tails, heads : ndarray of int, shape (k,)
        In ascending order, by tail first. A pair and its reverse are two.
    """
    width = int(heads.max(initial=0)) + 1
    tails, heads = np.divmod(np.unique(tails * width + heads), width)
    return tails, heads
