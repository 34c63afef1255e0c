"""Routes through a channel of triangles.

M. Innocenti, L. Pollini and A. Bracci (2006), section 2.4.1, step c, after M. Kallmann (2005), *Path planning in
triangulations*: the cheapest chain of adjacent triangles between start and goal, measured along the middles of the
sides between triangles. Each method draws its own route through the chain.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from oxbow.arrays import FloatArray
from oxbow.geometry.route.danger import NO_DANGER, Danger
from oxbow.geometry.route.mesh import WaterMesh
from oxbow.geometry.route.network import Ends, Links, Way
from oxbow.geometry.route.search import Arcs

__all__ = ["Channel", "Gates"]


@dataclass(frozen=True)
class Channel:
    """A chain of adjacent triangles from one place to another.

    Parameters
    ----------
    start, goal : ndarray, shape (2,)
        In the first and in the last triangle, in metres.
    left, right : ndarray, shape (k, 2)
        The ends of the gates between triangles, as seen on the way from start to goal.
    corners : ndarray, shape (k + 1, 3, 2)
        The triangles; one where start and goal lie in one.
    """

    start: FloatArray
    goal: FloatArray
    left: FloatArray
    right: FloatArray
    corners: FloatArray


@dataclass(frozen=True)
class Gates:
    """The network of the sides between triangles; places are the middles of all sides, shores among them.

    Parameters
    ----------
    mesh
        The water; zones' outlines are among its sides.
    danger
        The danger zones, as they count for one vehicle.
    """

    mesh: WaterMesh
    danger: Danger = NO_DANGER

    @cached_property
    def places(self) -> FloatArray:
        """See `Network.places`."""
        return np.asarray((self.mesh.tails + self.mesh.heads) / 2)

    @cached_property
    def arcs(self) -> Arcs:
        """See `Network.arcs`: from each gate, passed outwards, to the other gates of the triangle beyond it."""
        twins = self.mesh.twins
        gates = np.flatnonzero(twins >= 0)
        beyond = 3 * (twins[gates] // 3)[:, None] + np.arange(3)
        onward = (twins[beyond] >= 0) & (beyond != twins[gates][:, None])
        tails = np.broadcast_to(gates[:, None], beyond.shape)[onward]
        return Arcs.one_way(self.places, tails, beyond[onward], self.danger)

    def links(self, ends: Ends) -> Links:
        """See `Network.links`: out through the gates of the triangles that ends touch, in through their twins."""
        end, side = ends.at.sides()
        inner = self.mesh.twins[side] >= 0
        end, side = end[inner], side[inner]
        return Links(end, side, self.mesh.twins[side], *ends.at.companions())

    def channel(self, way: Way) -> Channel:
        """The triangles that a way passes."""
        gates = way.nodes
        if len(gates):
            triangles = np.concatenate([gates[:1] // 3, self.mesh.twins[gates] // 3])
        else:
            at = way.ends.at
            triangles = np.intersect1d(at.triangle[at.place == 0], at.triangle[at.place == 1])[:1]
        return Channel(
            start=way.start,
            goal=way.goal,
            left=self.mesh.heads[gates],
            right=self.mesh.tails[gates],
            corners=self.mesh.corners[triangles],
        )
