"""The Kohonen ring: nodes that order themselves along the path (Rendas and Li 2016, section 1.2.1.4)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from oxbow.arrays import FloatArray
from oxbow_path.refinement.guard import Guard
from oxbow_path.refinement.polyline import Polyline

__all__ = ["NODES_PER_SPACING", "Epoch", "UpdateSchedule", "organised_curve"]

NODES_PER_SPACING = 1.8
"""Nodes of the first ring, per spacing of the longest path."""

NODES_RANGE = (0.5, 3.0)
"""Bounds on the number of nodes, as multiples of the first."""

LONGEST, SHORTEST = 1.4, 0.7
"""Segments are divided above, and nodes dropped below, these lengths, in mean ones."""

LENGTH_AIMED = 0.985
"""Share of the longest length that the number of nodes is adjusted for."""

LEAST_DRAWS = 1e-3
"""A node whose whole neighbourhood has drawn less than this stays."""


@dataclass(frozen=True)
class UpdateSchedule:
    """How often the ring is updated, and how the width of the neighbourhood falls, in nodes."""

    epochs: int
    first_width: float = 2.0
    last_width: float = 0.5

    def width(self, epoch: int) -> float:
        """Geometric from the first to the last."""
        share = epoch / max(self.epochs - 1, 1)
        return float(self.first_width * (self.last_width / self.first_width) ** share)


@dataclass(frozen=True)
class Epoch:
    """The ring after one batch update, and the width of the neighbourhood that was used."""

    ring: Polyline
    width: float


def organised_curve(
    ring: Polyline,
    draws: FloatArray,
    weights: FloatArray,
    guard: Guard,
    *,
    length_m: float,
    spacing_m: float,
    schedule: UpdateSchedule,
    stop: Callable[[], bool],
) -> Iterator[Epoch]:
    """Update a ring of nodes until it is spread over the draws, epoch by epoch.

    Each epoch gives every draw to its nearest node, and moves every node to the mean of its neighbourhood's draws,
    weighted by a Gaussian along the ring: the batch form of Kohonen's rule (Kohonen 2001, section 3.6), where the
    report draws one input after another. The number of nodes follows the length, by dividing long segments and
    dropping crowded nodes, where the report samples the whole path anew. The guard ensures what the report leaves
    open: no update leaves the free space or makes the ring meet itself.

    Parameters
    ----------
    ring
        The initial state: the walk over the cells' circuit.
    draws, weights
        Inputs (n, 2), and the weight of each (n,).
    guard
        Bounds every move.
    length_m
        The longest path; the number of nodes is adjusted until the ring is about as long.
    spacing_m
        The nominal spacing, area / length.
    schedule
        Number of updates and width of the neighbourhood.
    stop
        Asked before each epoch whether time is up.

    Yields
    ------
    Epoch
        The ring after each update.
    """
    first_count = NODES_PER_SPACING * length_m / spacing_m
    least, most = (factor * first_count for factor in NODES_RANGE)
    count = first_count
    for number in range(schedule.epochs):
        if stop():
            return
        if number > 0:
            # The ring's length grows about with its nodes; bounded, since in narrow water more nodes add no
            # length.
            count = float(np.clip(count * LENGTH_AIMED * length_m / ring.length_m, least, most))
        mean_m = ring.length_m / count
        ring = guard.thinned(ring, ring.crowded(2 * SHORTEST * mean_m)).divided(LONGEST * mean_m)
        width = schedule.width(number)
        ring = guard.moved(ring, _means(ring, draws, weights, width))
        yield Epoch(ring, width)


def _means(ring: Polyline, draws: FloatArray, weights: FloatArray, width: float) -> FloatArray:
    """Where each node's neighbourhood has its mean, shape (n, 2)."""
    count = len(ring.nodes)
    _, winner = cKDTree(ring.nodes, balanced_tree=False, compact_nodes=False).query(draws, workers=-1)
    sums = np.column_stack([np.bincount(winner, weights * column, count) for column in (1.0, *draws.T)])
    # Sums and counts are spread alike, and then divided: the weighted mean over the whole neighbourhood, at the
    # cost of a filter rather than of a matrix.
    spread = gaussian_filter1d(sums, width, axis=0, mode="wrap" if ring.is_closed else "constant")
    drawn = spread[:, 0] > LEAST_DRAWS * weights.mean()
    means = ring.nodes.copy()
    means[drawn] = spread[drawn, 1:] / spread[drawn, :1]
    return means
