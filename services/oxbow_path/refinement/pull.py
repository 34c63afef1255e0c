"""Where the nodes would go: towards the samples that are far, as far as the length allows."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solveh_banded
from scipy.spatial import cKDTree

from oxbow.arrays import FloatArray, Indices
from oxbow_path.refinement.polyline import Polyline
from oxbow_path.refinement.samples import Samples

__all__ = ["Feet", "Pull", "PullSolution", "feet"]

STEP = 0.15
"""The nearest segment of a sample is looked for among points of the path this far apart, in spacings."""

INERTIA = 0.3
"""How strongly a node holds to its place, against the median pull of the samples."""

EXACTNESS = 1e-10
"""The same against the pull on itself: where one sample pulls far more than all others, rounding leaves a pair of
nodes nothing that holds it, and the equations no solution."""

TENSION_RANGE = (1e-4, 1e3)
"""The tension first looked for, in median pulls times the spacing."""

TENSION_CHANGE = 8.0
"""How much the tension may change from one step to the next."""

HALVINGS = 10
"""Bisections of the tension, in its logarithm."""

SHORTEST = 1e-3
"""Segments pull their ends together as if at least this long, in spacings."""


@dataclass(frozen=True)
class Feet:
    """The foot of each sample on the path: on which segment, at which share of it (0 to 1), how far away."""

    segment: Indices
    share: FloatArray
    distance_m: FloatArray

    def on(self, nodes: FloatArray) -> FloatArray:
        """The feet's positions, shape (n, 2)."""
        start = nodes[self.segment]
        return np.asarray(start + self.share[:, None] * (nodes[self.segment + 1] - start))


def feet(path: Polyline, points: FloatArray, spacing_m: float) -> Feet:
    """The nearest place of the path to each point.

    The segment is that of the nearest of many points along the path, or one of its two neighbours.

    Parameters
    ----------
    path
        Where the feet are.
    points
        Shape (m, 2), in metres.
    spacing_m
        The nominal spacing, which scales the distance of the points along the path.

    Returns
    -------
    Feet
        One per point.
    """
    pieces = np.maximum(1, np.ceil(path.lengths_m / (STEP * spacing_m)).astype(int))
    owner = np.repeat(np.arange(len(pieces)), pieces)
    piece = np.arange(len(owner)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    edge = np.diff(path.nodes, axis=0)
    along = path.nodes[owner] + ((piece + 0.5) / pieces[owner])[:, None] * edge[owner]
    _, nearest = cKDTree(along, balanced_tree=False, compact_nodes=False).query(points, workers=-1)
    best = np.full(len(points), np.inf)
    segment, share = owner[nearest], np.zeros(len(points))
    squared_m2 = np.maximum(path.lengths_m**2, np.finfo(float).tiny)
    # By axis: sums over pairs take several times as long as sums of two arrays.
    (px, py), (x, y), (ex, ey) = (np.ascontiguousarray(each.T) for each in (points, path.nodes, edge))
    # The nearest point along the path need not be on the nearest segment where two meet at a bend.
    for step in (0, -1, 1):
        candidate = np.clip(owner[nearest] + step, 0, len(edge) - 1)
        ox, oy, cx, cy = px - x[candidate], py - y[candidate], ex[candidate], ey[candidate]
        at = np.clip((ox * cx + oy * cy) / squared_m2[candidate], 0.0, 1.0)
        distance2 = (ox - at * cx) ** 2 + (oy - at * cy) ** 2
        nearer = distance2 < best
        best[nearer], segment[nearer], share[nearer] = distance2[nearer], candidate[nearer], at[nearer]
    return Feet(segment, share, np.sqrt(best))


@dataclass(frozen=True)
class PullSolution:
    """Where the nodes (n, 2) would go, and under which tension."""

    nodes: FloatArray
    tension: float


@dataclass(frozen=True)
class Pull:
    """The normal equations of one step: samples pull their feet, segments pull their ends together.

    Minimised is the sum of pull * |sample - foot|^2 over the samples, plus tension * |segment|^2 / length over the
    segments: reweighted least squares (Weiszfeld 1937) for a power of the distances and for the
    length. Only neighbours along the path share an equation, so that the matrix is tridiagonal.
    """

    path: Polyline
    diagonal: FloatArray
    beside: FloatArray
    right: FloatArray
    inverse_length: FloatArray

    @classmethod
    def of(
        cls, path: Polyline, samples: Samples, at: Feet, pull: FloatArray, step: float, spacing_m: float
    ) -> Pull:
        """Set up the equations.

        Parameters
        ----------
        path
            With n nodes.
        samples
            The m places that pull.
        at
            The foot of each on the path.
        pull
            How strongly each pulls, shape (m,).
        step
            The share of the way to its sample that a foot is pulled.
        spacing_m
            The nominal spacing, which bounds the pull of short segments.

        Returns
        -------
        Pull
            Solved under any tension by `solved`.
        """
        count = len(path.nodes)
        on = at.on(path.nodes)
        goal = on + step * (samples.points - on)
        # A foot lies between two nodes, and each is pulled by its share: the matrix has three diagonals, and is
        # symmetric.
        first, second = pull * (1.0 - at.share), pull * at.share

        def gathered(at_start: FloatArray, at_end: FloatArray) -> FloatArray:
            return np.asarray(
                np.bincount(at.segment, at_start, count) + np.bincount(at.segment + 1, at_end, count)
            )

        diagonal = gathered(first * (1.0 - at.share), second * at.share)
        right = np.column_stack([gathered(first * axis, second * axis) for axis in goal.T])
        beside = gathered(first * at.share, np.zeros_like(second))[:-1]
        # The median, since a few far samples lead the mean, which would hold all other nodes fast.
        hold = INERTIA * float(np.median(diagonal[diagonal > 0])) + EXACTNESS * diagonal
        return cls(
            path,
            diagonal + hold,
            beside,
            right + hold[:, None] * path.nodes,
            1.0 / np.maximum(path.lengths_m, SHORTEST * spacing_m),
        )

    def solved(self, tension: float) -> FloatArray:
        """The nodes (n, 2) where all pulls balance; pinned ones stay."""
        taut = tension * self.inverse_length
        diagonal = self.diagonal.copy()
        diagonal[:-1] += taut
        diagonal[1:] += taut
        beside, right, pinned = self.beside - taut, self.right.copy(), self.path.pinned
        # What pinned nodes contribute moves to the right-hand side, so that the matrix stays symmetric.
        held = np.where(pinned[:, None], self.path.nodes, 0.0)
        right[:-1] -= beside[:, None] * held[1:]
        right[1:] -= beside[:, None] * held[:-1]
        diagonal[pinned], right[pinned] = 1.0, self.path.nodes[pinned]
        free = ~(pinned[:-1] | pinned[1:])
        banded = np.vstack([np.append(0.0, beside * free), diagonal])
        # Linear in the number of nodes. The matrix is positive definite: every node is held to its place.
        return np.asarray(solveh_banded(banded, right, check_finite=False))

    def fitted(self, length_m: float, tension: float | None, spacing_m: float) -> PullSolution:
        """The solution about as long as `length_m`, and no longer where the tensions tried suffice for that.

        Parameters
        ----------
        length_m
            How long the path is to become.
        tension
            That of the step before, near which this one's is looked for; None in the first step.
        spacing_m
            The nominal spacing, which scales the tensions that the first step tries.

        Returns
        -------
        PullSolution
            Longer than `length_m` only where even the greatest tension tried leaves it so.
        """
        if tension is None:
            unit = float(np.median(self.diagonal)) * spacing_m
            low, high = (factor * unit for factor in TENSION_RANGE)
        else:
            low, high = tension / TENSION_CHANGE, tension * TENSION_CHANGE
        for _ in range(HALVINGS):
            # The geometric middle: the range spans orders of magnitude.
            middle = math.sqrt(low * high)
            # Length falls as tension grows; `high` is always a tension under which it fits, or the greatest
            # allowed.
            if np.hypot(*np.diff(self.solved(middle), axis=0).T).sum() > length_m:
                low = middle
            else:
                high = middle
        # The first `high` is never tried: where it is too weak, the path comes out longer than asked for. That is
        # no fault, since the next step looks on from there, and a path that is too long is not taken. In 390 steps
        # over three real lakes it was never returned.
        return PullSolution(self.solved(high), high)
