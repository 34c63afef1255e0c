"""Assign targets to vehicles: cluster, match, order; then improve.

Clusters of targets go to vehicles, and each vehicle puts its own in order (Innocenti, Pollini and Bracci 2006,
section 4.4). The report knows neither ranges nor balance; insertions and exchanges account for these afterwards.
"""

from __future__ import annotations

import enum
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from oxbow.arrays import Indices
from oxbow.errors import InvalidRequest
from oxbow_assignment.targets.assignment import TargetAssignment, assignment_of
from oxbow_assignment.targets.clustering import Clusters, cluster_by_radius, fuzzy_c_means, k_means
from oxbow_assignment.targets.exchange import with_exchanges
from oxbow_assignment.targets.insertion import trimmed_path, with_insertions, with_trades
from oxbow_assignment.targets.matching import match
from oxbow_assignment.targets.ordering import EXACT_MOST, best_path, exact_path
from oxbow_assignment.targets.problem import COST, Problem
from oxbow_assignment.targets.pseudo_coordinates import PseudoCoordinates, pseudo_coordinates

__all__ = ["ClusterMethod", "Clustered", "Clustering", "assign", "cluster_paths", "mended_paths"]

STARTS = 3
"""Starts of k-means: three leave two thirds of the gap of one to the joint optimiser, five hardly less."""


class ClusterMethod(enum.StrEnum):
    """How targets are clustered."""

    K_MEANS = "k-means"
    FUZZY_C_MEANS = "fuzzy c-means"
    RADIUS = "radius"


@dataclass(frozen=True)
class Clustering:
    """How targets are clustered.

    Parameters
    ----------
    method
        k-means or fuzzy c-means with `k` clusters, or as many as `radius_m` asks for.
    k
        The number of clusters; by default the number of vehicles that can visit a target. There are never more
        clusters than targets.
    radius_m
        The longest mean route from a target to its cluster's targets; for `ClusterMethod.RADIUS` and only for it.
    seed, starts
        The seed of k-means, and how many times it starts: the best assignment counts.

    Raises
    ------
    InvalidRequest
        A number or a radius is missing, out of place or not positive.
    """

    method: ClusterMethod = ClusterMethod.K_MEANS
    k: int | None = None
    radius_m: float | None = None
    seed: int = 0
    starts: int = STARTS

    def __post_init__(self) -> None:
        by_radius = self.method is ClusterMethod.RADIUS
        if by_radius != (self.radius_m is not None):
            raise InvalidRequest(
                f"is {self.radius_m!r}; expected a number >= 0 for method {ClusterMethod.RADIUS.value!r} and none"
                f" for another; the method is {self.method.value!r}",
                where="radius_m",
            )
        if self.k is not None and (by_radius or self.k < 1):
            raise InvalidRequest(f"is {self.k}; expected 1 or more, and none with a radius", where="k")
        if self.starts < 1:
            raise InvalidRequest(f"is {self.starts}; expected 1 or more", where="starts")


@dataclass(frozen=True)
class Clustered:
    """An assignment, and the clusters that it was made from.

    Parameters
    ----------
    assignment
        Who visits which targets.
    targets : ndarray of shape (m,)
        The targets that were clustered: those that some vehicle can visit.
    clusters
        Their clusters; None if there are no such targets.
    owners : ndarray of shape (k,)
        The index of the vehicle that each cluster was matched to.
    stress
        How badly the clusters' space represents the routes; see `PseudoCoordinates`.
    """

    assignment: TargetAssignment
    targets: Indices
    clusters: Clusters | None
    owners: Indices
    stress: float


def assign(problem: Problem, clustering: Clustering | None = None) -> Clustered:
    """Assign targets to vehicles by clusters.

    Parameters
    ----------
    problem
        The targets, the vehicles, and the routes between them.
    clustering
        How targets are clustered; by default `Clustering()`.

    Returns
    -------
    Clustered
        The best assignment of all starts. Every tour is within its vehicle's range, and every target is either in
        a tour or among the unserved.
    """
    clustering = clustering or Clustering()
    targets = np.flatnonzero(problem.can_visit.any(axis=0))
    if not len(targets):
        idle = [problem.path(vehicle, ()) for vehicle in range(len(problem.vehicles))]
        return Clustered(assignment_of(problem, idle), targets, None, np.empty(0, dtype=np.intp), 0.0)
    # By mean costs: clusters are of targets, and which vehicle gets them is decided only afterwards.
    coordinates = pseudo_coordinates(problem.mean_costs[np.ix_(targets, targets)])
    found = (
        _by_clusters(problem, targets, coordinates, clusters)
        for clusters in _clusterings(problem, coordinates, clustering)
    )
    return min(found, key=lambda clustered: clustered.assignment.rank)


def _by_clusters(
    problem: Problem, targets: Indices, coordinates: PseudoCoordinates, clusters: Clusters
) -> Clustered:
    owners = match(problem, clusters, targets)
    paths = cluster_paths(problem, targets, clusters, owners)
    # Mended before starts are compared: a clustering is as good as what can be made of it.
    assignment = assignment_of(problem, mended_paths(problem, paths, [0] * len(paths)))
    return Clustered(assignment, targets, clusters, owners, coordinates.stress)


def cluster_paths(problem: Problem, targets: Indices, clusters: Clusters, owners: Indices) -> list[Indices]:
    """Each vehicle's path through its own clusters, as far as its range allows: all that the report does.

    Parameters
    ----------
    problem
        The targets, the vehicles, and the routes between them.
    targets
        The targets that were clustered, shape (m,).
    clusters
        Their clusters.
    owners
        The index of each cluster's vehicle, shape (k,).

    Returns
    -------
    list of ndarray of int
        One path per vehicle: rows of the problem's distances, start first and recovery last.
    """
    own = owners[clusters.labels]
    return [
        trimmed_path(
            problem,
            vehicle,
            best_path(problem.figures[COST, vehicle], problem.path(vehicle, targets[own == vehicle])),
        )
        for vehicle in range(len(problem.vehicles))
    ]


def mended_paths(problem: Problem, paths: Sequence[Indices], held: Sequence[int]) -> list[Indices]:
    """Paths after insertions, exchanges and trades, which alternate until nothing more is gained.

    Parameters
    ----------
    problem
        The targets, the vehicles, and the routes between them.
    paths
        One per vehicle, each within its range: rows of the problem's distances, start first and recovery last.
    held
        How many leading targets of each path stay in front.

    Returns
    -------
    list of ndarray of int
        One path per vehicle, within its range; its held targets come first, as they were.
    """
    while True:
        paths = with_exchanges(problem, with_insertions(problem, paths, held), held)
        traded_paths = with_trades(problem, paths, held)
        # By identity: `with_trades` returns the same array for a path that it leaves alone.
        if all(path is before for path, before in zip(traded_paths, paths, strict=True)):
            return [_exact(problem, vehicle, path, held[vehicle]) for vehicle, path in enumerate(paths)]
        paths = traded_paths


def _exact(problem: Problem, vehicle: int, path: Indices, held: int) -> Indices:
    """A path in the best order behind its held targets; unchanged if they are too many, or it is out of range."""
    if len(path) - held > EXACT_MOST + 2:
        return path
    # The least cost is not the least length where there is danger: the cheapest order may exceed the range.
    best = np.concatenate([path[:held], exact_path(problem.figures[COST, vehicle], path[held:])])
    return best if problem.is_within_range(vehicle, best) else path


def _clusterings(problem: Problem, coordinates: PseudoCoordinates, clustering: Clustering) -> Iterator[Clusters]:
    if clustering.radius_m is not None:
        yield cluster_by_radius(coordinates, clustering.radius_m)
        return
    able = int(problem.can_visit.any(axis=1).sum())
    k = min(clustering.k or able, len(coordinates.places))
    cluster = fuzzy_c_means if clustering.method is ClusterMethod.FUZZY_C_MEANS else k_means
    for start in range(clustering.starts):
        yield cluster(coordinates, k, seed=clustering.seed + start)
