"""All tours as arrays, so that all moves between them can be weighed at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from oxbow.arrays import FloatArray, Indices, Mask
from oxbow_assignment.targets.problem import COST, LENGTH, SUM_ROUNDING, Problem

__all__ = ["Layout"]


@dataclass(frozen=True)
class Layout:
    """Paths, one after another; figures are cost and length (`COST`, `LENGTH`), in metres.

    Parameters
    ----------
    problem, paths
        What they are paths of: rows of the distances, start first and recovery last.
    rows, tour : ndarray of shape (m,)
        The row at each place, and whose path it is on.
    along : ndarray of shape (2, v, m)
        Figures from the first place of all, for each vehicle; what leads from one path to the next is 0.
    edge : ndarray of shape (2, m)
        Figures from each place to the next for the vehicle whose path it is: 0 for a path without targets, which
        nobody goes.
    is_open : ndarray of shape (m,)
        Whether something may come between a place and the next.
    is_free : ndarray of shape (m,)
        Whether a place holds a target that may move.
    place : ndarray of shape (n + 2 v,)
        Where each row is; -1 for targets that nobody visits.
    firsts, fronts, lasts : ndarray of shape (v,)
        The place of each start, of the last that stays behind it, and of each recovery.
    totals : ndarray of shape (2, v)
        Each path's figures.
    """

    problem: Problem
    paths: Sequence[Indices]
    rows: Indices
    tour: Indices
    along: FloatArray
    edge: FloatArray
    is_open: Mask
    is_free: Mask
    place: Indices
    firsts: Indices
    fronts: Indices
    lasts: Indices
    totals: FloatArray

    @classmethod
    def of(cls, problem: Problem, paths: Sequence[Indices], held: Sequence[int]) -> Layout:
        """Lay out paths; their first `held` targets stay in front."""
        sizes = np.array([len(path) for path in paths])
        rows, tour = np.concatenate(paths), np.repeat(np.arange(len(paths)), sizes)
        lasts = np.cumsum(sizes) - 1
        firsts = lasts - sizes + 1
        fronts = firsts + np.asarray(held)
        edges = np.zeros((2, len(paths), len(rows)))
        edges[:, :, :-1] = problem.figures[:, :, rows[:-1], rows[1:]]
        edges[:, :, lasts] = 0.0
        edges[:, :, firsts[sizes == 2]] = 0.0
        along = np.zeros_like(edges)
        np.cumsum(edges[:, :, :-1], axis=2, out=along[:, :, 1:])
        edge = edges[:, tour, np.arange(len(rows))]
        is_open = np.arange(len(rows)) >= fronts[tour]
        is_free = is_open & (rows < problem.count)
        is_free[fronts] = False
        is_open[lasts] = False
        place = np.full(problem.figures.shape[-1], -1)
        place[rows] = np.arange(len(rows))
        totals = edge @ (tour[:, None] == np.arange(len(paths)))
        return cls(problem, paths, rows, tour, along, edge, is_open, is_free, place, firsts, fronts, lasts, totals)

    def between(self, vehicles: Indices, first: Indices, last: Indices) -> FloatArray:
        """Figures for vehicles from one place of a path along it to a later one, shape (2, k)."""
        return np.asarray(self.along[:, vehicles, last] - self.along[:, vehicles, first])

    def joint(self, left: Indices, right: Indices) -> FloatArray:
        """Figures between two places of one path once nothing is between them: 0 if that empties it."""
        owner = self.tour[left]
        is_empty = (left == self.firsts[owner]) & (right == self.lasts[owner])
        return np.where(is_empty, 0.0, self.problem.figures[:, owner, self.rows[left], self.rows[right]])

    def gains(
        self, one: Indices, new_one: FloatArray, other: Indices, new_other: FloatArray, possible: Mask
    ) -> FloatArray:
        """What the objective gains if two tours get new figures; -inf where a tour would be too long."""
        strain, limits = self.problem.strain, self.problem.lengths_m * (1.0 - SUM_ROUNDING)
        fits = (new_one[LENGTH] <= limits[one]) & (new_other[LENGTH] <= limits[other])
        before = strain(self.totals[COST, one], one) + strain(self.totals[COST, other], other)
        costs = np.maximum(new_one[COST], 0.0), np.maximum(new_other[COST], 0.0)
        after = strain(costs[0], one) + strain(costs[1], other)
        return np.where(possible & fits, before - after, -np.inf)
