"""All tours as arrays, so that all moves between them can be evaluated at once."""

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
        The problem, and one path per vehicle: rows of its distances, start first and recovery last.
    rows, tour : ndarray of shape (m,)
        The row at each place, and the vehicle whose path it is on.
    along : ndarray of shape (2, v, m)
        Running sums of figures from the very first place, for each vehicle; steps from one path to the next are 0.
    edge : ndarray of shape (2, m)
        Figures from each place to the next, for the vehicle whose path it is: 0 for a path without targets, which
        is not travelled.
    is_open : ndarray of shape (m,)
        Whether something may come between a place and the next.
    is_free : ndarray of shape (m,)
        Whether a place has a target that may move.
    place : ndarray of shape (n + 2 v,)
        The place of each row; -1 for targets that no vehicle visits.
    firsts, fronts, lasts : ndarray of shape (v,)
        The places of each start, of the last target held behind it (else the start), and of each recovery.
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
        """Lay out paths.

        Parameters
        ----------
        problem
            The targets, the vehicles, and the routes between them.
        paths
            One per vehicle: rows of the problem's distances, start first and recovery last.
        held
            How many leading targets of each path stay in front.

        Returns
        -------
        Layout
            A snapshot: after a move, the tours are laid out anew.
        """
        sizes = np.array([len(path) for path in paths])
        rows, tour = np.concatenate(paths), np.repeat(np.arange(len(paths)), sizes)
        lasts = np.cumsum(sizes) - 1
        firsts = lasts - sizes + 1
        fronts = firsts + np.asarray(held)
        edges = np.zeros((2, len(paths), len(rows)))
        edges[:, :, :-1] = problem.figures[:, :, rows[:-1], rows[1:]]
        edges[:, :, lasts] = 0.0
        edges[:, :, firsts[sizes == 2]] = 0.0
        # Running sums over all places: the length of any stretch is then one subtraction, for thousands of moves
        # at once.
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
        """Figures from one place of a path along it to a later one, shape (2, k).

        Parameters
        ----------
        vehicles
            The vehicles that would travel there, maybe not the path's own, shape (k,).
        first, last
            The places, each pair on one path, shape (k,).

        Returns
        -------
        ndarray of float, shape (2, k)
            In metres, to within the rounding of running sums.
        """
        return np.asarray(self.along[:, vehicles, last] - self.along[:, vehicles, first])

    def joint(self, left: Indices, right: Indices) -> FloatArray:
        """Figures between two places of one path once nothing is between them, shape (2, k).

        They are 0 if the path is then empty, since a vehicle without targets stays where it is.

        Parameters
        ----------
        left, right
            The places, each pair on one path, shape (k,).

        Returns
        -------
        ndarray of float, shape (2, k)
            In metres.
        """
        owner = self.tour[left]
        is_empty = (left == self.firsts[owner]) & (right == self.lasts[owner])
        return np.where(is_empty, 0.0, self.problem.figures[:, owner, self.rows[left], self.rows[right]])

    def gains(
        self, one: Indices, new_one: FloatArray, other: Indices, new_other: FloatArray, possible: Mask
    ) -> FloatArray:
        """What the objective gains by moves that each change two tours, shape (k,); -inf if a tour gets too long.

        Parameters
        ----------
        one, other
            The vehicles whose tours change, shape (k,).
        new_one, new_other
            Cost and length of their new tours, in metres, shape (2, k).
        possible
            Which moves the roles allow, shape (k,).

        Returns
        -------
        ndarray of float, shape (k,)
            In seconds, or their power for a makespan; positive where a move is worth making.
        """
        strain, limits = self.problem.strain, self.problem.lengths_m * (1.0 - SUM_ROUNDING)
        # A little below the range: summed along the path itself, the same length may come out greater.
        fits = (new_one[LENGTH] <= limits[one]) & (new_other[LENGTH] <= limits[other])
        before = strain(self.totals[COST, one], one) + strain(self.totals[COST, other], other)
        # Differences of running sums may come out just below 0.
        costs = np.maximum(new_one[COST], 0.0), np.maximum(new_other[COST], 0.0)
        after = strain(costs[0], one) + strain(costs[1], other)
        return np.where(possible & fits, before - after, -np.inf)
