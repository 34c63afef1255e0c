"""Moves that keep a path inside and simple: what would break either is not moved, or not as far."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon, STRtree
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import Indices, Mask
from oxbow.contracts import FloatArray
from oxbow.tolerances import ROUNDING_M
from oxbow_path.refinement.polyline import Polyline

__all__ = ["Guard"]

CLEARANCE = 0.02
"""Least distance between stretches of the path that are no neighbours, in spacings, unless they began nearer."""

NEIGHBOURS = 2
"""Segments so near along the path may come nearer than the clearance: a bend joins them."""

HALVINGS = 3
"""How often a node's step is halved before the node stays."""

LOCAL_ROUNDS = 8
"""After so many rounds the neighbours of what still is at fault stay too."""

ROUNDS = 14

FOLD, RETURN = -0.9999, -1.0 + 1e-9
"""Cosines of the turn at which a node folds its two segments nearly, and as good as wholly, onto each other."""


@dataclass(frozen=True)
class Guard:
    """Keeps a path inside the free space, apart from itself.

    Every state that it lets through is one that it has checked as a whole, or the one before: so a path that was
    inside and simple stays both, whatever moves are asked for.
    """

    free: BaseGeometry
    clearance_m: float

    @classmethod
    def of(cls, free: Polygon, path: Polyline, spacing_m: float) -> Guard:
        """Guard a path; one whose stretches began nearer than the usual clearance may stay half as near."""
        grown = free.buffer(ROUNDING_M)
        shapely.prepare(grown)
        segments = path.segments
        pairs = STRtree(segments).query(segments, predicate="dwithin", distance=CLEARANCE * spacing_m)
        first, second = _beyond(path, pairs[:, ~path.legs[pairs].any(axis=0)], NEIGHBOURS)
        near_m = shapely.distance(segments[first], segments[second])
        return cls(grown, min([CLEARANCE * spacing_m, *(near_m / 2)]))

    def faults(self, path: Polyline, suspect: Mask | None = None, excused: Mask | None = None) -> Mask:
        """Which segments (n - 1,) leave the free space, or meet, fold onto or come too near another.

        Where only some segments are suspect, the others are known to be at fault with none but those. Excused ones
        may come near and fold sharply, but neither meet another nor run back on themselves.
        """
        segments = path.segments
        asked = np.arange(len(segments)) if suspect is None else np.flatnonzero(suspect)
        excused = path.legs if excused is None else path.legs | excused
        fault = np.zeros(len(segments), dtype=bool)
        fault[asked] = ~shapely.covers(self.free, segments[asked]) & ~path.legs[asked]
        index, other = STRtree(segments).query(segments[asked], predicate="dwithin", distance=self.clearance_m)
        near = _beyond(path, np.stack([asked[index], other]), 1)
        # Neighbours but one, and legs, which begin side by side, may come near, but not meet.
        may_be_near = (_steps_between(path, near) <= NEIGHBOURS) | excused[near].any(axis=0)
        may_be_near &= ~shapely.intersects(segments[near[0]], segments[near[1]])
        fault[near[:, ~may_be_near]] = True
        folded = _folded(path, FOLD) & ~(excused[:-1] & excused[1:]) | _folded(path, RETURN)
        fault[:-1] |= folded
        fault[1:] |= folded
        return fault

    def moved(self, path: Polyline, target: FloatArray) -> Polyline:
        """The path with its nodes as far on the way to `target` (n, 2) as keeps it inside and simple.

        What is too near or too sharp in the path as it is must not hold all the rest: it is excused.
        """
        moved = self._moved(path, target, None)
        if moved is None:
            moved = self._moved(path, target, self.faults(path))
        return path if moved is None else moved

    def _moved(self, path: Polyline, target: FloatArray, excused: Mask | None) -> Polyline | None:
        step = np.where(path.pinned[:, None], 0.0, target - path.nodes)
        share = np.ones(len(path.nodes))
        suspect: Mask | None = None
        moved = path
        for turn in range(ROUNDS):
            moved = moved.moved(path.nodes + share[:, None] * step)
            fault = self.faults(moved, suspect, excused)
            if not fault.any():
                return moved
            blamed = _ends(fault)
            if turn >= LOCAL_ROUNDS:
                blamed[1:] |= blamed[:-1]
                blamed[:-1] |= blamed[1:]
            share[blamed] = share[blamed] / 2 if turn < HALVINGS else 0.0
            suspect = blamed[:-1] | blamed[1:]
        return None

    def thinned(self, path: Polyline, drop: Mask) -> Polyline:
        """The path without the nodes to drop, but for those whose loss would put it at fault."""
        before: Mask | None = None
        while drop.any():
            kept = np.flatnonzero(~drop)
            merged = np.diff(kept) > 1
            thinner = path.without(drop)
            fault = self.faults(thinner, merged, None if before is None else before[kept[:-1]])
            if not fault.any():
                return thinner
            if (fault & merged).any():
                restored = np.zeros(len(drop) + 1, dtype=int)
                np.add.at(restored, kept[:-1][fault], 1)
                np.add.at(restored, kept[1:][fault], -1)
                drop = drop & (np.cumsum(restored)[:-1] == 0)
            elif before is None:
                # What is at fault was so before: it is excused, and stays as it is.
                before = self.faults(path)
                drop = drop & ~_ends(before)
            else:
                break
        return path


def _steps_between(path: Polyline, pairs: Indices) -> Indices:
    """How many segments on along the path the second of each pair (2, m) is."""
    count = len(path.legs)
    steps = np.abs(pairs[1] - pairs[0])
    return np.asarray(np.minimum(steps, count - steps) if path.is_closed else steps)


def _beyond(path: Polyline, pairs: Indices, steps: int) -> Indices:
    """The pairs that are more than so many segments apart along the path."""
    return np.asarray(pairs[:, _steps_between(path, pairs) > steps])


def _ends(segment: Mask) -> Mask:
    """The nodes (n,) of the chosen segments (n - 1,)."""
    return np.asarray(np.append(segment, False) | np.append(False, segment))


def _folded(path: Polyline, cosine: float) -> Mask:
    """At which inner nodes (n - 2,) the turn's cosine is less."""
    edge = np.diff(path.nodes, axis=0)
    product = path.lengths_m[:-1] * path.lengths_m[1:]
    return np.asarray((edge[:-1] * edge[1:]).sum(axis=1) < cosine * np.maximum(product, np.finfo(float).tiny))
