"""The order in which one vehicle visits its targets: a path from its start to its recovery.

Paths are arrays of rows of one matrix of distances, the start first and the recovery last. The order of targets is
exact up to `EXACT_MOST` targets and a local optimum above.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oxbow.arrays import FloatArray, Indices

__all__ = ["EXACT_MOST", "best_path", "exact_path", "improved_path", "inserted_path", "neighbours", "path_length"]

EXACT_MOST = 12
"""The most targets that are ordered exactly: 2^12 sets of targets times 12 last ones take a few milliseconds."""

NEIGHBOURS = 10
"""How many near targets of each target are considered (D. S. Johnson and L. A. McGeoch, 1997, use 8 to 20)."""

SEGMENT = 3
"""The most targets that move together (I. Or, 1976)."""

LEAST_GAIN = 1e-9
"""Gains of no more than this fraction of the path's length are rounding."""


def path_length(distances: FloatArray, path: Indices) -> float:
    """Metres along a path.

    Parameters
    ----------
    distances
        In metres, shape (m, m).
    path
        Rows of `distances`, shape (n,).

    Returns
    -------
    float
        In metres.
    """
    return float(distances[path[:-1], path[1:]].sum())


def best_path(distances: FloatArray, path: Indices) -> Indices:
    """The rows of a path in a better order: the shortest up to `EXACT_MOST` targets, a local optimum above.

    Parameters
    ----------
    distances : ndarray of shape (m, m)
        Symmetric and finite, in metres.
    path : ndarray of shape (n + 2,)
        Rows of `distances`; the first and the last stay, those between may come in any order.

    Returns
    -------
    ndarray of int, shape (n + 2,)
        The same rows, the first and the last in their places.
    """
    if len(path) <= EXACT_MOST + 2:
        return exact_path(distances, path)
    return improved_path(distances, inserted_path(distances, path))


def exact_path(distances: FloatArray, path: Indices) -> Indices:
    """The shortest path by dynamic programming over sets (M. Held and R. M. Karp, 1962; R. Bellman, 1962).

    `lengths[s, j]` is the least length from the start through the set s, a bit mask, ending at target j; sets
    of one size are one array operation. Memory doubles with every target.

    Parameters
    ----------
    distances
        Symmetric and finite, in metres, shape (m, m).
    path
        Rows of `distances`, the first and the last of which stay, shape (n + 2,).

    Returns
    -------
    ndarray of int, shape (n + 2,)
        The same rows in the best order.
    """
    start, targets, end = path[0], path[1:-1], path[-1]
    n = len(targets)
    between = distances[np.ix_(targets, targets)]
    sizes = np.bitwise_count(np.arange(1 << n))
    lengths = np.full((1 << n, n), np.inf)
    lengths[1 << np.arange(n), np.arange(n)] = distances[start, targets]
    for size in range(1, n):
        sets = np.flatnonzero(sizes == size)
        longer = (lengths[sets, :, None] + between).min(axis=1)
        rows, added = np.nonzero((sets[:, None] >> np.arange(n)) & 1 == 0)
        lengths[sets[rows] | (1 << added), added] = longer[rows, added]
    # Backwards through the table: the last target first, then the best one before it.
    onward, order, left = distances[targets, end], [], (1 << n) - 1
    while left:
        last = int((lengths[left] + onward).argmin())
        order.append(last)
        left, onward = left ^ (1 << last), between[:, last]
    return np.array([start, *targets[order[::-1]], end])


def inserted_path(distances: FloatArray, path: Indices) -> Indices:
    """A path by farthest insertion (D. J. Rosenkrantz, R. E. Stearns and P. M. Lewis, 1977).

    Parameters
    ----------
    distances
        Symmetric and finite, in metres, shape (m, m).
    path
        Rows of `distances`, the first and the last of which stay; the order of the others does not matter, but for
        ties. Shape (n + 2,).

    Returns
    -------
    ndarray of int, shape (n + 2,)
        The same rows in another order.
    """
    left, path = path[1:-1], path[[0, -1]]
    nearest = distances[np.ix_(left, path)].min(axis=1)
    while len(left):
        farthest = int(nearest.argmax())
        target = left[farthest]
        before, after = path[:-1], path[1:]
        place = int((distances[before, target] + distances[target, after] - distances[before, after]).argmin())
        path = np.insert(path, place + 1, target)
        left, nearest = np.delete(left, farthest), np.delete(nearest, farthest)
        nearest = np.minimum(nearest, distances[left, target])
    return path


def improved_path(distances: FloatArray, path: Indices) -> Indices:
    """A path that no 2-opt and no Or-opt move between neighbours shortens, its first and last row kept.

    2-opt reverses a stretch of the path (G. A. Croes, 1958), Or-opt moves up to `SEGMENT` targets elsewhere,
    either way round (I. Or, 1976). Only moves that join near targets are considered, all of them at once, and the
    best is made.

    Parameters
    ----------
    distances
        Symmetric and finite, in metres, shape (m, m).
    path
        Rows of `distances`, shape (n,).

    Returns
    -------
    ndarray of int, shape (n,)
        The same rows in an order that is no longer.
    """
    if len(path) < 4:
        return path
    local = distances[np.ix_(path, path)]
    # Few near rows each: nearly every move that shortens a path makes a leg to one of them.
    near = neighbours(local)
    order = np.arange(len(path))
    least_m = LEAST_GAIN * path_length(distances, path)
    while True:
        best = max(
            _best_two_opt(local, order, near), _best_or_opt(local, order, near), key=lambda move: move.gain_m
        )
        if best.gain_m <= least_m:
            return path[order]
        order = order[best.positions]


def neighbours(distances: FloatArray) -> Indices:
    """The nearest rows of every row, shape (m, k), itself left out."""
    away = distances.copy()
    np.fill_diagonal(away, np.inf)
    k = min(NEIGHBOURS, len(away) - 1)
    # Which they are matters, not their order: a partition is linear where sorting is not.
    nearest: Indices = np.argpartition(away, k - 1, axis=1)[:, :k]
    return nearest


@dataclass(frozen=True)
class _Move:
    """What a move gains, and for each position after it the position before it."""

    gain_m: float
    positions: Indices


def _best_two_opt(local: FloatArray, order: Indices, near: Indices) -> _Move:
    """Reverse what is between two cuts, so that a row and one of its neighbours meet."""
    position = np.argsort(order)
    here, there = np.arange(len(order))[:, None], position[near[order]]
    low, high = np.minimum(here, there), np.maximum(here, there)
    # Two rows can be joined by reversing what lies between them, up to the one or up to the other.
    before = np.stack([low, low - 1]).ravel()
    until = np.stack([high, high - 1]).ravel()
    possible = np.flatnonzero((before >= 0) & (until < len(order) - 1))
    before, until = before[possible], until[possible]
    a, b, c, d = order[before], order[before + 1], order[until], order[until + 1]
    gains = local[a, b] + local[c, d] - local[a, c] - local[b, d]
    best = int(gains.argmax())
    positions = np.arange(len(order))
    stretch = slice(int(before[best]) + 1, int(until[best]) + 1)
    positions[stretch] = positions[stretch][::-1]
    return _Move(float(gains[best]), positions)


def _best_or_opt(local: FloatArray, order: Indices, near: Indices) -> _Move:
    """Move a segment between a neighbour of one of its ends and the row before or after that neighbour."""
    position = np.argsort(order)
    moves = []
    for length in range(1, min(SEGMENT, len(order) - 3) + 1):
        starts = np.arange(1, len(order) - length)
        first, last = order[starts], order[starts + length - 1]
        left, right = order[starts - 1], order[starts + length]
        # What is saved by taking the segment out, and where it could go in: beside a near target of either end.
        saved = local[left, first] + local[last, right] - local[left, right]
        joins = position[np.concatenate([near[first], near[last]], axis=1)]
        edges = np.concatenate([joins - 1, joins], axis=1)
        since = edges - starts[:, None]
        possible = (edges >= 0) & (edges < len(order) - 1) & ((since < -1) | (since >= length))
        edges = np.where(possible, edges, 0)
        # Either way round, whichever costs less.
        p, q, first, last = order[edges], order[edges + 1], first[:, None], last[:, None]
        kept, turned = local[p, first] + local[last, q], local[p, last] + local[first, q]
        gains = np.where(possible, saved[:, None] - np.minimum(kept, turned) + local[p, q], -np.inf)
        row, column = np.unravel_index(int(gains.argmax()), gains.shape)
        is_turned = bool(turned[row, column] < kept[row, column])
        start, edge = int(starts[row]), int(edges[row, column])
        moves.append((float(gains[row, column]), start, length, edge, is_turned))
    gain_m, start, length, edge, is_turned = max(moves)
    segment = np.arange(start, start + length)[:: -1 if is_turned else 1]
    rest = np.delete(np.arange(len(order)), slice(start, start + length))
    # Places behind the segment have moved forward by its length once it is taken out.
    place = edge + 1 if edge < start else edge + 1 - length
    return _Move(gain_m, np.insert(rest, place, segment))
