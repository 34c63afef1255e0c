"""Which segments of a path come near each other: searched for with points, measured with arrays.

Making a line for every segment and a tree over them takes longer than all else in a refinement. Lines are made of
those few segments alone for which arithmetic with rounding leaves the answer open.
"""

from __future__ import annotations

import numpy as np
import shapely
from scipy.spatial import cKDTree

from oxbow.arrays import FloatArray, Indices, Mask
from oxbow.tolerances import ROUNDING_M
from oxbow_path.refinement.polyline import Polyline

__all__ = ["beyond", "least_gap_m", "may_meet", "nearer", "steps_between"]

PIECE = 2.0
"""Long segments are searched for in pieces no longer than this many mean segments."""


def may_meet(path: Polyline, asked: Indices, reach_m: FloatArray, most_m: float) -> Indices:
    """Pairs (2, m) of segments, one of them asked, that can come nearer than some distance; neighbours left out.

    Parameters
    ----------
    path
        Where the segments are.
    asked
        The numbers of those that are asked for.
    reach_m
        How far each segment may move, plus half the distance that counts as near; shape (n - 1,).
    most_m
        The longest piece of a segment that is searched for as one.

    Returns
    -------
    ndarray of int, shape (2, m)
        The lesser number of each pair first; no pair twice.
    """
    # A search over circles finds pairs as far apart as the widest: one long segment would pair with half the path.
    longest_m = min(most_m, PIECE * float(path.lengths_m.mean()))
    pieces = np.maximum(1, np.ceil(path.lengths_m / max(longest_m, ROUNDING_M))).astype(int)
    owner = np.repeat(np.arange(len(pieces)), pieces)
    piece = np.arange(len(owner)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    edge = np.diff(path.nodes, axis=0)
    middle = path.nodes[owner] + ((piece + 0.5) / pieces[owner])[:, None] * edge[owner]
    radius_m = path.lengths_m[owner] / (2 * pieces[owner]) + reach_m[owner]
    is_asked = np.zeros(len(pieces), dtype=bool)
    is_asked[asked] = True
    # A search by circles, which over-reports: whatever is found is measured exactly by `nearer`.
    near = _within(middle, radius_m, is_asked[owner])
    pairs = np.sort(owner[near], axis=0)
    return _distinct(beyond(path, pairs, 1)) if len(owner) > len(pieces) else beyond(path, pairs, 1)


def _distinct(pairs: Indices) -> Indices:
    """Pairs (2, m) of numbers, each once. Sorting takes a fraction of the time of numpy's table for `unique`."""
    count = pairs.max(initial=0) + 1
    key = np.sort(pairs[0] * count + pairs[1])
    return np.stack(np.divmod(key[np.append(True, key[1:] != key[:-1])[: len(key)]], count))


def _within(points: FloatArray, radius_m: FloatArray, asked: Mask) -> Indices:
    """Pairs (2, m) of points, one of them asked, whose circles meet; each once."""
    tree = cKDTree(points, balanced_tree=False, compact_nodes=False)
    if asked.all():
        pairs = tree.query_pairs(2 * radius_m.max(), output_type="ndarray").T
    else:
        chosen = np.flatnonzero(asked)
        few = cKDTree(points[chosen], balanced_tree=False, compact_nodes=False)
        reach_m = radius_m[chosen].max(initial=0.0) + radius_m.max()
        found = few.sparse_distance_matrix(tree, reach_m, output_type="ndarray")
        pairs = np.stack([chosen[found["i"]], found["j"]])
        pairs = pairs[:, (pairs[0] < pairs[1]) | ~asked[pairs[1]]]
    apart_m = np.hypot(*(points[pairs[0]] - points[pairs[1]]).T)
    return np.asarray(pairs[:, apart_m <= radius_m[pairs].sum(axis=0)])


def nearer(path: Polyline, pairs: Indices, clearance_m: float, touching_m: float) -> tuple[Indices, Mask]:
    """The pairs (2, m) of segments that are no farther apart than the clearance, and which of them touch.

    Parameters
    ----------
    path
        Where the segments are.
    pairs
        Numbers of segments, shape (2, m).
    clearance_m
        The distance up to which two segments count as near.
    touching_m
        The distance up to which they touch.

    Returns
    -------
    tuple of ndarray
        The near pairs, shape (2, k), and whether those of each touch, shape (k,).
    """
    # From cheap to exact: circles about the middles, then arithmetic with room for rounding, then GEOS.
    middle = (path.nodes[1:] + path.nodes[:-1]) / 2
    reach_m = path.lengths_m[pairs].sum(axis=0) / 2 + clearance_m + ROUNDING_M
    pairs = pairs[:, np.hypot(*(middle[pairs[0]] - middle[pairs[1]]).T) <= reach_m]
    pairs = pairs[:, _gaps_m(path.nodes, pairs) <= clearance_m + ROUNDING_M]
    first, second = (shapely.linestrings(path.nodes[np.stack([one, one + 1], axis=1)]) for one in pairs)
    near = np.asarray(shapely.dwithin(first, second, clearance_m))
    return pairs[:, near], np.asarray(shapely.dwithin(first[near], second[near], touching_m))


def least_gap_m(path: Polyline, pairs: Indices) -> float:
    """The least distance between the two segments of any pair; infinite without pairs.

    Parameters
    ----------
    path
        Where the segments are.
    pairs
        Numbers of segments, shape (2, m).

    Returns
    -------
    float
        In metres, up to rounding; 0 where two cross.
    """
    return float(_gaps_m(path.nodes, pairs).min(initial=np.inf))


def steps_between(path: Polyline, pairs: Indices) -> Indices:
    """How many segments the two of each pair are apart along the path, the shorter way round a closed one.

    Parameters
    ----------
    path
        Where the segments are.
    pairs
        Numbers of segments, shape (2, m).

    Returns
    -------
    ndarray of int, shape (m,)
        1 for neighbours.
    """
    count = len(path.legs)
    steps = np.abs(pairs[1] - pairs[0])
    return np.asarray(np.minimum(steps, count - steps) if path.is_closed else steps)


def beyond(path: Polyline, pairs: Indices, steps: int) -> Indices:
    """The pairs that are more than `steps` segments apart along the path.

    Parameters
    ----------
    path
        Where the segments are.
    pairs
        Numbers of segments, shape (2, m).
    steps
        1 leaves out neighbours.

    Returns
    -------
    ndarray of int, shape (2, k)
        In the order of `pairs`.
    """
    return np.asarray(pairs[:, steps_between(path, pairs) > steps])


def _gaps_m(nodes: FloatArray, pairs: Indices) -> FloatArray:
    """The distance between the two segments of each pair (2, m), up to rounding."""
    (a, b), (c, d) = ((nodes[one], nodes[one + 1]) for one in pairs)
    # Two segments are nearest at an end of one of them, unless they cross.
    apart = np.min([_from_segment_m(*ends) for ends in ((a, c, d), (b, c, d), (c, a, b), (d, a, b))], axis=0)
    crosses = (_side(a, c, d) * _side(b, c, d) < 0.0) & (_side(c, a, b) * _side(d, a, b) < 0.0)
    return np.where(crosses, 0.0, apart)


def _from_segment_m(point: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    edge, offset = end - start, point - start
    squared_m2 = np.maximum((edge**2).sum(axis=1), np.finfo(float).tiny)
    at = np.clip((offset * edge).sum(axis=1) / squared_m2, 0.0, 1.0)
    return np.asarray(np.hypot(*(offset - at[:, None] * edge).T))


def _side(point: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """On which side of a line a point lies: the sign of this."""
    edge, offset = end - start, point - start
    return np.asarray(edge[:, 0] * offset[:, 1] - edge[:, 1] * offset[:, 0])
