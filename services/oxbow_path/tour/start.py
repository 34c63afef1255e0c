"""A first tour without a long leg."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array

from oxbow.arrays import FloatArray, Indices
from oxbow_path.tour.geodesic import Geodesics

__all__ = ["Start", "first_tour"]


@dataclass(frozen=True)
class Start:
    """A tour, and the distances for its improvement: those of near sites, and of its own legs."""

    order: Indices
    distances: csr_array[np.float64]

    def length_m(self, order: Indices) -> float:
        """The length of a tour whose legs are all among the distances; others count as 0."""
        return float(np.asarray(self.distances[order, np.roll(order, -1)]).sum())


def first_tour(geodesics: Geodesics, limit_m: float) -> Start:
    """A tour whose legs each pass at most three legs of the least spanning tree.

    Such a tour exists round every tree (Sekanina 1960): visit a site, then for each child the tour of its subtree
    backwards, which begins at a child of the child and ends at the child. However far the water winds, no leg has
    to come back along a whole arm, as the last legs of a greedy tour do.

    Parameters
    ----------
    geodesics
        Between at least three sites.
    limit_m
        The greatest distance of near sites.

    Returns
    -------
    Start
        A tour of all sites, with the distances of near pairs and of its own legs.
    """
    order = _round_tree(geodesics.spanning_tree())
    near = geodesics.near(limit_m)
    legs = np.column_stack([order, np.roll(order, -1)])
    far = legs[np.asarray(near[legs[:, 0], legs[:, 1]]) == 0.0]
    return Start(order, _joined(near, far, geodesics.between_m(*far.T)))


def _round_tree(tree: csr_array[np.float64]) -> Indices:
    legs = coo_array(tree)
    beside: list[list[int]] = [[] for _ in range(tree.shape[0])]
    for a, b in zip(legs.row.tolist(), legs.col.tolist(), strict=True):
        beside[a].append(b)
        beside[b].append(a)
    parents, outward = {0: 0}, [0]
    # The list grows while it is read: breadth first, so that every child comes after its parent.
    for site in outward:
        children = [other for other in beside[site] if other != parents[site]]
        parents.update(dict.fromkeys(children, site))
        outward.extend(children)
    tours: dict[int, list[int]] = {}
    for site in reversed(outward):
        tour = [site]
        for child in beside[site]:
            if child != parents[site]:
                tour.extend(reversed(tours.pop(child)))
        tours[site] = tour
    return np.array(tours[0])


def _joined(near: csr_array[np.float64], legs: Indices, lengths: FloatArray) -> csr_array[np.float64]:
    """The near distances and those of some legs, both ways."""
    a, b = legs.reshape(-1, 2).T
    both = coo_array((np.tile(lengths, 2), (np.concatenate([a, b]), np.concatenate([b, a]))), shape=near.shape)
    return csr_array(near + both)
