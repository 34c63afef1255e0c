"""All tours as arrays, so that all moves between them can be weighed at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from oxbow.arrays import Indices, Mask
from oxbow.contracts import FloatArray
from oxbow_assignment.problem import ROUNDING, Problem

__all__ = ["Layout"]


@dataclass(frozen=True)
class Layout:
    """Paths, one after another.

    Parameters
    ----------
    problem, paths
        What they are paths of: rows of the distances, start first and recovery last.
    rows, tour : ndarray of shape (m,)
        The row at each place, and whose path it is on.
    along_m : ndarray of shape (m,)
        Metres from the path's start.
    edge_m : ndarray of shape (m,)
        Metres from each place to the next: 0 for a path without targets, which nobody goes.
    is_open : ndarray of shape (m,)
        Whether something may come between a place and the next.
    is_free : ndarray of shape (m,)
        Whether a place holds a target that may move.
    place : ndarray of shape (n + 2 v,)
        Where each row is; -1 for targets that nobody visits.
    firsts, fronts, lasts : ndarray of shape (v,)
        The place of each start, of the last that stays behind it, and of each recovery.
    lengths_m : ndarray of shape (v,)
        Each path's length.
    """

    problem: Problem
    paths: Sequence[Indices]
    rows: Indices
    tour: Indices
    along_m: FloatArray
    edge_m: FloatArray
    is_open: Mask
    is_free: Mask
    place: Indices
    firsts: Indices
    fronts: Indices
    lasts: Indices
    lengths_m: FloatArray

    @classmethod
    def of(cls, problem: Problem, paths: Sequence[Indices], held: Sequence[int]) -> Layout:
        """Lay out paths; their first `held` targets stay in front."""
        sizes = np.array([len(path) for path in paths])
        rows, tour = np.concatenate(paths), np.repeat(np.arange(len(paths)), sizes)
        lasts = np.cumsum(sizes) - 1
        firsts = lasts - sizes + 1
        fronts = firsts + np.asarray(held)
        edge_m = np.append(problem.finite[rows[:-1], rows[1:]], 0.0)
        edge_m[lasts] = 0.0
        edge_m[firsts[sizes == 2]] = 0.0
        along_m = np.concatenate([[0.0], np.cumsum(edge_m)[:-1]])
        along_m -= along_m[firsts][tour]
        is_open = np.arange(len(rows)) >= fronts[tour]
        is_free = is_open & (rows < problem.count)
        is_free[fronts] = False
        is_open[lasts] = False
        place = np.full(len(problem.finite), -1)
        place[rows] = np.arange(len(rows))
        lengths_m = along_m[lasts]
        return cls(
            problem, paths, rows, tour, along_m, edge_m, is_open, is_free, place, firsts, fronts, lasts, lengths_m
        )

    def joint_m(self, left: Indices, right: Indices) -> FloatArray:
        """Metres between the rows at two places of one path once nothing is between them: 0 if that empties it."""
        is_empty = (left == self.firsts[self.tour[left]]) & (right == self.lasts[self.tour[right]])
        return np.where(is_empty, 0.0, self.problem.finite[self.rows[left], self.rows[right]])

    def gains(
        self, one: Indices, one_m: FloatArray, other: Indices, other_m: FloatArray, possible: Mask
    ) -> FloatArray:
        """What the objective gains if two tours get new lengths; -inf where a tour would be too long."""
        problem = self.problem
        limits = problem.lengths_m * (1.0 - ROUNDING)
        fits = (one_m <= limits[one]) & (other_m <= limits[other])
        before = problem.strain(self.lengths_m[one], one) + problem.strain(self.lengths_m[other], other)
        after = problem.strain(np.maximum(one_m, 0.0), one) + problem.strain(np.maximum(other_m, 0.0), other)
        return np.where(possible & fits, before - after, -np.inf)
