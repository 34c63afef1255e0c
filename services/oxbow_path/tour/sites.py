"""Sites: points spread evenly over the water, for a tour to visit (Rendas and Li 2016, section 1.2.1.3)."""

from __future__ import annotations

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely import Polygon

from oxbow.arrays import FloatArray
from oxbow.geometry.triangles import spread
from oxbow_path.halton import halton

__all__ = ["cluster_centres", "low_discrepancy", "with_gaps"]

ROUNDS = 12
"""Rounds of Lloyd's algorithm: few, as the first points of the sequence are nearly even already."""


def low_discrepancy(free: Polygon, count: int, *, seed: int) -> FloatArray:
    """Points of low discrepancy over a polygon, by area.

    The report keeps those points of a sequence over the bounding box that lie in the polygon. Here every point of
    the Halton sequence is used, carried from the unit square onto the polygon (`oxbow.geometry.triangles.spread`).
    The sequence is shifted at random, modulo 1 (Cranley and Patterson 1976).

    Parameters
    ----------
    free
        Where the points lie.
    count
        How many points.
    seed
        Of the random shift.

    Returns
    -------
    array, shape (count, 2)
        Its first points alone are spread evenly, too.
    """
    shift = np.random.default_rng(seed).random(2)
    return spread((halton(count) + shift) % 1.0, free)


def cluster_centres(samples: FloatArray, count: int, free: Polygon) -> FloatArray:
    """The centres of `count` clusters of samples, by k-means (Lloyd 1982) started from the first samples.

    A centre that lies on land, between two shores, is moved to the nearest sample.

    Parameters
    ----------
    samples : array, shape (m, 2)
        A low-discrepancy sequence inside `free`, much longer than `count`.
    count
        How many clusters, at most m.
    free
        The water (prepared or not).

    Returns
    -------
    array, shape (n, 2)
        Sorted by x, then y; n is `count`, less centres that coincide.
    """
    centres = samples[:count]
    for _ in range(ROUNDS):
        _, owner = cKDTree(centres).query(samples)
        size = np.bincount(owner, minlength=count)
        sums = np.column_stack([np.bincount(owner, weights=axis, minlength=count) for axis in samples.T])
        # A centre without samples stays where it is, rather than going to 0 / 0.
        centres = np.where(size[:, None] > 0, sums / np.maximum(size, 1)[:, None], centres)
    on_land = ~shapely.contains_xy(free, centres)
    _, nearest = cKDTree(samples).query(centres[on_land])
    centres[on_land] = samples[nearest]
    # Sorted: the tour must not depend on the order in which clusters were found.
    return np.unique(centres, axis=0)


def with_gaps(sites: FloatArray, points: FloatArray, reach_m: float) -> FloatArray:
    """The sites, and points made sites, the farthest first, until none is farther than `reach_m` from one.

    Parameters
    ----------
    sites
        Shape (n, 2), in metres.
    points
        Which places are to have a site near, shape (m, 2).
    reach_m
        How near.

    Returns
    -------
    ndarray, shape (k, 2)
        The given sites first.
    """
    distance, _ = cKDTree(sites).query(points)
    gaps = points[np.argsort(-distance, kind="stable")[: np.count_nonzero(distance > reach_m)]]
    if len(gaps) == 0:
        return sites
    index = cKDTree(gaps)
    near = np.zeros(len(gaps), dtype=bool)
    added = []
    for number, gap in enumerate(gaps):
        if not near[number]:
            near[index.query_ball_point(gap, reach_m)] = True
            added.append(gap)
    return np.vstack([sites, added])
