"""Moves that keep a path inside and simple: what would break either is not moved, or not as far."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray, Indices, Mask
from oxbow.tolerances import ROUNDING_M
from oxbow_path.refinement.inside import Inside
from oxbow_path.refinement.nearness import beyond, least_gap_m, may_meet, nearer, steps_between
from oxbow_path.refinement.polyline import Polyline

__all__ = ["Guard"]

CLEARANCE = 0.02
"""Least distance between stretches of the path that are not neighbours, in spacings, unless they began nearer."""

NEIGHBOURS = 2
"""Segments at most this many apart along the path may come nearer than the clearance: a bend joins them."""

HALVINGS = 3
"""How often a node's step is halved before the node stays."""

LOCAL_ROUNDS = 8
"""After this many rounds the neighbours of what is still at fault stay too."""

ROUNDS = 14
"""Attempts at a move before the path stays as it is."""

LOCAL = 0.5
"""Where no node moves farther, in spacings, what can come near what is found once for all shares of a move."""

BORDER_PITCH = 0.1
"""Distance of the places that stand for the free space's border in look-ups, in spacings."""

FOLD, RETURN = -0.9999, -1.0 + 1e-9
"""Cosines of the turn at which a node folds its two segments nearly, and to rounding wholly, onto each other."""


@dataclass(frozen=True)
class _Known:
    """Which segments may meet (2, m), and how far from the border each node (n,) is at least."""

    pairs: Indices
    clear_m: FloatArray


@dataclass(frozen=True)
class Guard:
    """Keeps a path inside the free space, apart from itself.

    Every path that it returns is one that it has checked, or the one that it was given. So a path that was inside
    and simple stays both, whatever moves are asked for.
    """

    free: BaseGeometry
    clearance_m: float
    spacing_m: float
    touching_m: float = ROUNDING_M

    @classmethod
    def of(cls, free: Polygon, path: Polyline, spacing_m: float) -> Guard:
        """Guard a path; one whose stretches began nearer than the usual clearance may stay half as near.

        The same holds for one that began nearer than rounding, which alone could make a crossing of it: from the
        mission's plane to degrees and back, say.

        Parameters
        ----------
        free
            The free space.
        path
            A simple path inside it, except for its legs.
        spacing_m
            The nominal spacing, which scales clearance and look-ups.

        Returns
        -------
        Guard
            For this path and what it is moved to; for another path it would have to be made anew.
        """
        grown = free.buffer(ROUNDING_M)
        shapely.prepare(grown)
        usual_m = CLEARANCE * spacing_m
        every = np.arange(len(path.legs))
        # Half the clearance to either side: two circles meet where the segments are within the whole.
        pairs = may_meet(path, every, np.full(len(every), usual_m / 2), spacing_m)
        near = beyond(path, pairs[:, ~path.legs[pairs].any(axis=0)], NEIGHBOURS)
        gap_m = least_gap_m(path, near)
        clearance_m = gap_m / 2 if gap_m < usual_m else usual_m
        return cls(grown, clearance_m, spacing_m, min(ROUNDING_M, least_gap_m(path, pairs) / 2))

    @cached_property
    def _inside(self) -> Inside:
        return Inside(self.free, BORDER_PITCH * self.spacing_m)

    def faults(
        self,
        path: Polyline,
        suspect: Mask | None = None,
        excused: Mask | None = None,
        known: _Known | None = None,
    ) -> Mask:
        """Which segments (n - 1,) leave the free space, or meet, fold onto or come too near another.

        Where only some segments are suspect, the others are known to be at fault with none but those. Excused ones
        may come near and fold sharply, but neither meet another nor run back on themselves.

        Parameters
        ----------
        path
            With n nodes.
        suspect
            The segments (n - 1,) that are tested, against all others; by default all.
        excused
            Segments (n - 1,) that may come near others and fold sharply, as legs may.
        known
            Pairs and clearances that hold however the nodes move within some reach; by default those of `path`.

        Returns
        -------
        ndarray of bool, shape (n - 1,)
            For every segment, suspect or not.
        """
        asked = np.arange(len(path.legs)) if suspect is None else np.flatnonzero(suspect)
        # A caller that tries shares of one small move passes what holds for all of them; else it is found for
        # this path.
        known = known or self._known(path, asked)
        excused = path.legs if excused is None else path.legs | excused
        fault = np.zeros(len(path.legs), dtype=bool)
        afloat = asked[~path.legs[asked]]
        fault[afloat] = self._inside.leaving(path, afloat, known.clear_m)
        pairs = known.pairs if suspect is None else known.pairs[:, suspect[known.pairs].any(axis=0)]
        near, meets = nearer(path, pairs, self.clearance_m, self.touching_m)
        # Segments two apart along the path, and legs, which begin side by side, may come near, but not meet.
        may_be_near = ~meets & ((steps_between(path, near) <= NEIGHBOURS) | excused[near].any(axis=0))
        fault[near[:, ~may_be_near]] = True
        folded = _folded(path, FOLD) & ~(excused[:-1] & excused[1:]) | _folded(path, RETURN)
        fault[:-1] |= folded
        fault[1:] |= folded
        return fault

    def _known(self, path: Polyline, asked: Indices, reach_m: FloatArray | float = 0.0) -> _Known:
        """What holds for some segments however their nodes (n,) move, each within its reach."""
        reach_m = np.broadcast_to(reach_m, len(path.nodes))
        each_m = np.maximum(reach_m[:-1], reach_m[1:]) + self.clearance_m / 2
        clear_m = np.full(len(path.nodes), -np.inf)
        clear_m[asked] = clear_m[asked + 1] = 0.0
        ends = np.flatnonzero(clear_m == 0.0)
        # Two circles of half a segment's length suffice, and few segments are much longer than most.
        enough_m = 2 * float(path.lengths_m.mean()) + reach_m.max()
        clear_m[ends] = self._inside.clear_m(path.nodes[ends], enough_m) - reach_m[ends]
        return _Known(may_meet(path, asked, each_m, self.spacing_m), clear_m)

    def moved(self, path: Polyline, target: FloatArray) -> Polyline:
        """The path with its nodes as far on the way to `target` (n, 2) as keeps it inside and simple.

        What is already too near or too sharp in the given path must not hold up the rest: it is excused as soon as
        a segment is at fault that does not move, and in a second attempt from the start.

        Parameters
        ----------
        path
            With n nodes.
        target
            Where its nodes are to go, shape (n, 2), in metres; pinned ones stay.

        Returns
        -------
        Polyline
            With the same n nodes; the path itself where no part of the move is sound.
        """
        moved = self._moved(path, target, None)
        if moved is None:
            moved = self._moved(path, target, self.faults(path))
        return path if moved is None else moved

    def _moved(self, path: Polyline, target: FloatArray, excused: Mask | None) -> Polyline | None:
        step = np.where(path.pinned[:, None], 0.0, target - path.nodes)
        reach_m = np.hypot(*step.T)
        is_local = reach_m.max(initial=0.0) <= LOCAL * self.spacing_m
        known = self._known(path, np.arange(len(path.legs)), reach_m) if is_local else None
        share = np.ones(len(path.nodes))
        suspect: Mask | None = None
        for turn in range(ROUNDS):
            moved = path.moved(path.nodes + share[:, None] * step)
            fault = self.faults(moved, suspect, excused, known)
            if not fault.any():
                return moved
            blamed = _ends(fault)
            if turn >= LOCAL_ROUNDS:
                blamed[1:] |= blamed[:-1]
                blamed[:-1] |= blamed[1:]
            # At fault although neither end moves: the fault was there before, and no share of the move can mend
            # it.
            is_held = (fault & ~_of_any(share > 0.0)).any()
            # Halved first, so that one fault costs its nodes a part of their step and not all of it.
            share[blamed] = share[blamed] / 2 if turn < HALVINGS else 0.0
            if is_held and excused is None:
                # A second attempt would find the same, and take as long.
                excused = self.faults(path, known=known)
                blamed |= _ends(excused)
                share[_ends(excused)] = 0.5**HALVINGS
            # What did not change since it was checked is not checked again.
            suspect = _of_any(blamed)
        return None

    def thinned(self, path: Polyline, drop: Mask) -> Polyline:
        """The path without the nodes to drop, except for those whose loss would put it at fault.

        Parameters
        ----------
        path
            With n nodes.
        drop
            The nodes (n,) to leave out, none of them pinned or an end of a rigid segment.

        Returns
        -------
        Polyline
            As sound as the given path; that path itself where nothing can go.
        """
        before: Mask | None = None
        while drop.any():
            kept = np.flatnonzero(~drop)
            merged = np.diff(kept) > 1
            thinner = path.without(drop)
            fault = self.faults(thinner, merged, None if before is None else before[kept[:-1]])
            if not fault.any():
                return thinner
            if (fault & merged).any():
                # Counts up where a segment at fault begins and down where it ends: all nodes it skips come back.
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


def _ends(segment: Mask) -> Mask:
    """The nodes (n,) of the chosen segments (n - 1,)."""
    return np.asarray(np.append(segment, False) | np.append(False, segment))


def _of_any(node: Mask) -> Mask:
    """The segments (n - 1,) with either end among the chosen nodes (n,)."""
    return np.asarray(node[:-1] | node[1:])


def _folded(path: Polyline, cosine: float) -> Mask:
    """At which inner nodes (n - 2,) the turn's cosine is less."""
    # By axis: sums over pairs take several times as long as sums of two arrays.
    x, y = np.diff(path.nodes, axis=0).T.copy()
    product = path.lengths_m[:-1] * path.lengths_m[1:]
    along = x[:-1] * x[1:] + y[:-1] * y[1:]
    return np.asarray(along < cosine * np.maximum(product, np.finfo(float).tiny))
