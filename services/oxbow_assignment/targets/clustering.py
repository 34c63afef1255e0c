"""Clusters of targets: k-means, fuzzy c-means, and a number of clusters that follows from a radius.

Targets are given by pseudo-coordinates (Innocenti, Pollini and Bracci 2006, section 4.4). Each has a weight
between 0 and 1, which fades after a visit, so that the centres move smoothly and clusters do not churn.

Missions are planned with k-means over equal weights. The rest is for replans on the way; no mission uses it yet.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oxbow.arrays import FloatArray, Indices
from oxbow.errors import InvalidRequest
from oxbow_assignment.targets.pseudo_coordinates import PseudoCoordinates

__all__ = ["Clusters", "cluster_by_radius", "fading_weights", "fuzzy_c_means", "k_means", "mean_distances"]

TURNS = 100
"""The most iterations; k-means converges long before."""

FUZZINESS = 2.0
"""The exponent of fuzzy c-means that J. C. Bezdek (1981) recommends."""

STILL = 1e-4
"""Memberships that change by less than this have converged."""


@dataclass(frozen=True)
class Clusters:
    """Which target belongs to which cluster.

    Parameters
    ----------
    labels : ndarray of shape (n,)
        The cluster of each target, 0 to k - 1.
    centres : ndarray of shape (k, d)
        In the space of the pseudo-coordinates, in metres; start from these to cluster again after small changes.
    memberships : ndarray of shape (n, k)
        How much each target belongs to each cluster; rows sum to 1, and entries are 0 or 1 for k-means.
    """

    labels: Indices
    centres: FloatArray
    memberships: FloatArray

    @property
    def count(self) -> int:
        return len(self.centres)


def fading_weights(since_visit_s: FloatArray, fade_s: float) -> FloatArray:
    """Weights of targets: 1 before a visit, then smoothly down to 0 in `fade_s` seconds.

    The report asks for a weight in [0, 1] that decreases smoothly from one to zero after the visit, and gives no
    formula. This is half a period of a cosine, whose slope is 0 at both ends.

    Parameters
    ----------
    since_visit_s : ndarray of shape (n,)
        Seconds since each target was visited; NaN for one that was not.
    fade_s
        Seconds that fading takes, > 0.

    Returns
    -------
    ndarray of float, of the shape of `since_visit_s`
        1 also where a target was never visited (NaN).

    Raises
    ------
    InvalidRequest
        `fade_s` is not positive.
    """
    if not fade_s > 0.0:
        raise InvalidRequest(f"is {fade_s!r} s; expected a number > 0", where="fade_s")
    share = np.clip(np.nan_to_num(since_visit_s, nan=0.0) / fade_s, 0.0, 1.0)
    weights: FloatArray = 0.5 * (1.0 + np.cos(np.pi * share))
    return weights


def k_means(
    coordinates: PseudoCoordinates,
    k: int,
    *,
    weights: FloatArray | None = None,
    centres: FloatArray | None = None,
    seed: int = 0,
) -> Clusters:
    """Weighted k-means by Lloyd's iteration (S. P. Lloyd, 1982).

    Parameters
    ----------
    coordinates
        The targets' places.
    k
        The number of clusters, at most the number of targets.
    weights : ndarray of shape (n,)
        Between 0 and 1, by default 1; see `fading_weights`.
    centres : ndarray of shape (k, d)
        Where to start; by default chosen by k-means++ (D. Arthur and S. Vassilvitskii, 2007).
    seed
        Seed of k-means++; unused if `centres` are given.

    Returns
    -------
    Clusters
        None of them empty.

    Raises
    ------
    InvalidRequest
        More clusters than targets, or weights outside [0, 1].
    """
    places, weights = coordinates.places, _checked_weights(coordinates, weights)
    _require_k(k, len(places))
    centres = _spread(places, k, weights, seed) if centres is None else centres
    labels = np.full(len(places), -1)
    for _ in range(TURNS):
        squares = _squares(places, centres)
        nearest = squares.argmin(axis=1)
        _fill_empty(nearest, squares, k)  # an empty cluster has no centroid
        if (nearest == labels).all():
            break
        labels = nearest
        centres = _centroids(places, np.eye(k)[labels], weights, centres)
    return Clusters(labels=labels, centres=centres, memberships=np.eye(k)[labels])


def fuzzy_c_means(
    coordinates: PseudoCoordinates, k: int, *, weights: FloatArray | None = None, seed: int = 0
) -> Clusters:
    """Fuzzy c-means (J. C. Bezdek, 1981), begun with k-means; each target's label is its largest membership.

    Parameters
    ----------
    coordinates
        The targets' places.
    k
        The number of clusters, at most the number of targets.
    weights : ndarray of shape (n,)
        Between 0 and 1, by default 1; see `fading_weights`.
    seed
        Seed of the k-means that comes first.

    Returns
    -------
    Clusters
        None of them empty, by label.

    Raises
    ------
    InvalidRequest
        More clusters than targets, or weights outside [0, 1].
    """
    places, weights = coordinates.places, _checked_weights(coordinates, weights)
    crisp = k_means(coordinates, k, weights=weights, seed=seed)
    memberships, centres = crisp.memberships, crisp.centres
    for _ in range(TURNS):
        # A target exactly at a centre would make this 0 / 0.
        squares = np.maximum(_squares(places, centres), np.finfo(float).tiny ** 0.5)
        closeness = (squares / squares.min(axis=1, keepdims=True)) ** (-1.0 / (FUZZINESS - 1.0))
        before, memberships = memberships, closeness / closeness.sum(axis=1, keepdims=True)
        centres = _centroids(places, memberships**FUZZINESS, weights, centres)
        if np.abs(memberships - before).max() < STILL:
            break
    labels = memberships.argmax(axis=1)
    _fill_empty(labels, 1.0 - memberships, k)
    return Clusters(labels=labels, centres=centres, memberships=memberships)


def cluster_by_radius(
    coordinates: PseudoCoordinates, radius_m: float, *, weights: FloatArray | None = None
) -> Clusters:
    """The report's dynamic procedure (Innocenti, Pollini and Bracci 2006, section 4.4, steps a to d).

    The norm, which the report leaves open, is that of the largest difference: a target's distance from a centre is
    then the length of its mean route to the cluster's targets (`mean_distances`), and the radius is in metres of
    route. When the procedure stops, no target of positive weight has a mean route of more than `radius_m` to its
    cluster. Centres move by k-means in the Euclidean norm.

    Parameters
    ----------
    coordinates
        The targets' places.
    radius_m
        The report's r: above 0 for clusters, 0 for one cluster per place.
    weights : ndarray of shape (n,)
        Between 0 and 1, by default 1; a target of weight 0 founds no cluster.

    Returns
    -------
    Clusters
        As few as the procedure needed; at most one per target.

    Raises
    ------
    InvalidRequest
        A radius that is negative or not a number, or weights outside [0, 1].
    """
    if not radius_m >= 0.0:
        raise InvalidRequest(f"is {radius_m!r} m; expected a number >= 0", where="radius_m")
    weights = _checked_weights(coordinates, weights)
    centres = np.average(coordinates.places, axis=0, weights=weights if weights.any() else None)[None, :]
    while True:
        clusters = k_means(coordinates, len(centres), weights=weights, centres=centres)
        away = mean_distances(coordinates, clusters, weights)[np.arange(len(weights)), clusters.labels]
        away = np.where(weights > 0.0, away, 0.0)
        farthest = int(away.argmax())
        # With as many clusters as targets no further one can help.
        if away[farthest] <= radius_m or clusters.count == len(weights):
            return clusters
        centres = np.vstack([clusters.centres, coordinates.places[farthest]])


def mean_distances(
    coordinates: PseudoCoordinates, clusters: Clusters, weights: FloatArray | None = None
) -> FloatArray:
    """The weighted mean route from each target to the targets of each cluster, in metres, shape (n, k).

    It is also the largest difference between the target's column of distances and the mean column of the
    cluster: no difference is larger, because distances obey the triangle inequality, and the target's own row
    attains it.

    Parameters
    ----------
    coordinates
        The targets' places and distances.
    clusters
        Clusters of these targets. One whose targets all have weight 0 counts them alike.
    weights : ndarray of shape (n,)
        Between 0 and 1, by default 1.

    Returns
    -------
    ndarray of float, shape (n, k)
        In metres along routes.
    """
    shares = clusters.memberships * _checked_weights(coordinates, weights)[:, None]
    # A cluster whose targets all have weight 0 still has a middle: it is taken without weights.
    shares = np.where(shares.sum(axis=0) > 0.0, shares, clusters.memberships)
    distances: FloatArray = coordinates.distances_m @ (shares / shares.sum(axis=0))
    return distances


def _squares(places: FloatArray, centres: FloatArray) -> FloatArray:
    """Squared Euclidean distances, shape (n, k)."""
    squares = (places**2).sum(axis=1)[:, None] + (centres**2).sum(axis=1)[None, :] - 2.0 * places @ centres.T
    # The expanded square is quick, a single product of matrices, but may come out just below 0 for equal points.
    clipped: FloatArray = np.maximum(squares, 0.0)
    return clipped


def _centroids(places: FloatArray, memberships: FloatArray, weights: FloatArray, before: FloatArray) -> FloatArray:
    """Weighted means, shape (k, d); a cluster whose targets all have weight 0 stays where it was."""
    shares = memberships * weights[:, None]
    total = shares.sum(axis=0)
    means = (shares.T @ places) / np.where(total > 0.0, total, 1.0)[:, None]
    return np.where(total[:, None] > 0.0, means, before)


def _spread(places: FloatArray, k: int, weights: FloatArray, seed: int) -> FloatArray:
    """k-means++: each further centre is a target, drawn with a chance that grows as its squared distance."""
    random = np.random.default_rng(seed)
    chances = weights if weights.any() else np.ones(len(places))
    chosen = [int(random.choice(len(places), p=chances / chances.sum()))]
    squares = _squares(places, places[chosen])[:, 0]
    while len(chosen) < k:
        drawn = squares * chances
        left = np.setdiff1d(np.arange(len(places)), chosen)
        chosen.append(
            int(random.choice(len(places), p=drawn / drawn.sum())) if drawn.any() else int(random.choice(left))
        )
        squares = np.minimum(squares, _squares(places, places[chosen[-1:]])[:, 0])
        squares[chosen] = 0.0  # exactly: rounding must not let a target be drawn twice
    return places[chosen]


def _fill_empty(labels: Indices, squares: FloatArray, k: int) -> None:
    """Give every empty cluster the target that is farthest from its own centre; changes `labels` in place."""
    for empty in np.flatnonzero(np.bincount(labels, minlength=k) == 0):
        spare = np.bincount(labels, minlength=k)[labels] > 1
        own = np.where(spare, squares[np.arange(len(labels)), labels], -1.0)
        labels[own.argmax()] = empty


def _checked_weights(coordinates: PseudoCoordinates, weights: FloatArray | None) -> FloatArray:
    count = len(coordinates.places)
    if weights is None:
        return np.ones(count)
    if weights.shape != (count,) or not ((weights >= 0.0) & (weights <= 1.0)).all():
        raise InvalidRequest(f"expected {count} numbers from 0 to 1, one per target", where="weights")
    return weights


def _require_k(k: int, count: int) -> None:
    if not 1 <= k <= count:
        raise InvalidRequest(f"is {k}; expected 1 to {count}, the number of targets", where="k")
