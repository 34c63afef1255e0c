"""Pruning: which sites a tour leaves out where the length does not suffice for all.

In water of many narrow arms, the ways in and out make up a tour's length however few its sites are. Then the far
ends of arms have to be left out.
"""

from __future__ import annotations

import heapq

import numpy as np

from oxbow.arrays import FloatArray, Indices
from oxbow_path.tour.geodesic import Geodesics

__all__ = ["pruned_order"]

LEAST_M = 1e-9
"""Sites may coincide."""


def pruned_order(order: Indices, geodesics: Geodesics, *, kept: int, length_m: float) -> Indices:
    """Leave out sites until a tour is short enough.

    The next to go is the one that saves most for how far from the tour its water will be, and the water of those
    left out beyond it: so all arms become shorter alike.

    Parameters
    ----------
    order
        A tour.
    geodesics
        The distances of its sites.
    kept
        The sites before this number stay in any case.
    length_m
        How long the tour may be.

    Returns
    -------
    array, shape (m,)
        The sites left, in order; where none but those that stay are left, their tour however long it is.
    """
    tour = _Tour(order, geodesics)
    gains = [(-tour.gain(site), site) for site in order.tolist() if site >= kept]
    heapq.heapify(gains)
    while gains and tour.length_m > length_m:
        gain, site = heapq.heappop(gains)
        # Gains on the heap are not updated: one that has changed was pushed again, and this entry is stale.
        if site in tour.after and -gain == tour.gain(site):
            for beside in tour.leave_out(site):
                if beside >= kept:
                    heapq.heappush(gains, (-tour.gain(beside), beside))
    return tour.order()


class _Tour:
    """A tour as a linked list; `far_m` is how far water that a site stands for is from it."""

    def __init__(self, order: Indices, geodesics: Geodesics) -> None:
        sites = order.tolist()
        self.after = dict(zip(sites, sites[1:] + sites[:1], strict=True))
        self._before = {site: before for before, site in self.after.items()}
        self._far_m = dict.fromkeys(sites, 0.0)
        self._geodesics = geodesics
        self._rows: dict[int, FloatArray] = {}
        self.length_m = sum(self._distance(site, other) for site, other in self.after.items())

    def gain(self, site: int) -> float:
        """Metres saved without a site, for every metre that its water is then from the tour."""
        nearest_m = min(self._distance(site, self._before[site]), self._distance(site, self.after[site]))
        return self._saved(site) / (self._far_m[site] + nearest_m + LEAST_M)

    def leave_out(self, site: int) -> tuple[int, int]:
        """Take a site out; the two beside it."""
        self.length_m -= self._saved(site)
        before, after = self._before.pop(site), self.after.pop(site)
        self.after[before], self._before[after] = after, before
        nearest = min(before, after, key=lambda beside: self._distance(site, beside))
        far_m = self._far_m[site] + self._distance(site, nearest)
        self._far_m[nearest] = max(self._far_m[nearest], far_m)
        return before, after

    def order(self) -> Indices:
        """The sites that are left."""
        first = next(iter(self.after))
        sites = [first]
        while self.after[sites[-1]] != first:
            sites.append(self.after[sites[-1]])
        return np.array(sites)

    def _saved(self, site: int) -> float:
        before, after = self._before[site], self.after[site]
        return self._distance(site, before) + self._distance(site, after) - self._distance(before, after)

    def _distance(self, a: int, b: int) -> float:
        if a not in self._rows:
            self._rows[a] = self._geodesics.from_site(a)
        return float(self._rows[a][b])
