"""The path as nodes that move, except for those that must stay."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely import LineString
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray, Indices, Mask

__all__ = ["Polyline"]


@dataclass(frozen=True)
class Polyline:
    """A path from launch to recovery as nodes.

    Attributes
    ----------
    nodes
        Positions, shape (n, 2).
    pinned
        Which nodes stay where they are (n,): the two ends, and those of legs outside the free space.
    legs
        Which segments are such legs (n - 1,).
    rigid
        Which segments stay one straight line (n - 1,): they slide and turn, and are never divided.
    """

    nodes: FloatArray
    pinned: Mask
    legs: Mask
    rigid: Mask

    @classmethod
    def of(cls, path: LineString, free: BaseGeometry, rigid: Mask | None = None) -> Polyline:
        """A path's own vertices as nodes.

        Parameters
        ----------
        path
            With n vertices.
        free
            The free space with room for rounding, prepared: segments that it does not cover are legs.
        rigid
            Which segments (n - 1,) stay one straight line; by default none.

        Returns
        -------
        Polyline
            With one node per vertex; its ends, and the nodes of segments that leave `free`, are pinned.
        """
        nodes = shapely.get_coordinates(path)
        segments = shapely.linestrings(np.stack([nodes[:-1], nodes[1:]], axis=1))
        legs = ~np.asarray(shapely.covers(free, segments))
        pinned = np.zeros(len(nodes), dtype=bool)
        pinned[[0, -1]] = True
        pinned[:-1] |= legs
        pinned[1:] |= legs
        return cls(nodes, pinned, legs, np.zeros(len(legs), dtype=bool) if rigid is None else rigid)

    @property
    def is_closed(self) -> bool:
        """Whether it ends where it starts."""
        return bool((self.nodes[0] == self.nodes[-1]).all())

    @cached_property
    def lengths_m(self) -> FloatArray:
        """The length of each segment, shape (n - 1,)."""
        return np.asarray(np.hypot(*np.diff(self.nodes, axis=0).T))

    @property
    def length_m(self) -> float:
        """The length of the whole path."""
        return float(self.lengths_m.sum())

    @property
    def line(self) -> LineString:
        """The path."""
        return LineString(self.nodes)

    def moved(self, nodes: FloatArray) -> Polyline:
        """The same nodes elsewhere."""
        return Polyline(nodes, self.pinned, self.legs, self.rigid)

    def divided(self, most_m: float) -> Polyline:
        """With nodes added so that no segment is longer than `most_m`, except for legs and rigid ones."""
        pieces = np.maximum(1, np.ceil(self.lengths_m / most_m).astype(int))
        pieces[self.legs | self.rigid] = 1
        return self._cut(pieces)

    def subdivided(self, pieces: int) -> Polyline:
        """With every segment cut into `pieces` equal ones."""
        return self._cut(np.full(len(self.legs), pieces))

    def _cut(self, pieces: Indices) -> Polyline:
        segment = np.repeat(np.arange(len(pieces)), pieces)
        piece = np.arange(len(segment)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
        share = (piece / pieces[segment])[:, None]
        nodes = self.nodes[segment] + share * np.diff(self.nodes, axis=0)[segment]
        return Polyline(
            np.vstack([nodes, self.nodes[-1:]]),
            # A new node is pinned only on a leg; else it is free even between two pinned ones.
            np.append(self.pinned[segment] & ((piece == 0) | self.legs[segment]), self.pinned[-1]),
            self.legs[segment],
            self.rigid[segment],
        )

    def without(self, drop: Mask) -> Polyline:
        """Without some nodes, none of them pinned or an end of a rigid segment."""
        kept = np.flatnonzero(~drop)
        return Polyline(self.nodes[kept], self.pinned[kept], self.legs[kept[:-1]], self.rigid[kept[:-1]])

    def crowded(self, least_m: float) -> Mask:
        """Nodes (n,) that could go: the segments on their two sides together are shorter than `least_m`.

        No two neighbours are among them.
        """
        crowded = np.zeros(len(self.nodes), dtype=bool)
        both = self.lengths_m[:-1] + self.lengths_m[1:] < least_m
        crowded[1:-1] = both & ~self.pinned[1:-1] & ~self.rigid[:-1] & ~self.rigid[1:]
        # Of a run of crowded nodes every second one may go, the first included.
        run = np.arange(len(crowded)) - np.maximum.accumulate(np.where(crowded, 0, np.arange(len(crowded))))
        return np.asarray(crowded & (run % 2 == 1))
