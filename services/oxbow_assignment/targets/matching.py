"""Clusters to vehicles: the Hungarian method (H. W. Kuhn, 1955), through SciPy."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment

from oxbow.arrays import FloatArray, Indices
from oxbow_assignment.targets.clustering import Clusters
from oxbow_assignment.targets.problem import COST, Problem

__all__ = ["match"]

OUT_OF_REACH = 1e3
"""A target that a vehicle cannot visit counts this many times the costliest route.

It is finite, so that there is always a matching, even if no vehicle can visit all of a cluster.
"""


def match(problem: Problem, clusters: Clusters, targets: Indices) -> Indices:
    """The vehicle of each cluster, of least sum of mean costs (Innocenti, Pollini and Bracci 2006, 4.2 and 4.4).

    The cost of a cluster to a vehicle is the mean duration of its routes to the cluster's targets. If there are
    more clusters than vehicles, the report adds fictitious vehicles. Instead, the clusters that these would get
    are matched in further rounds, in which each vehicle comes from the cluster that it got last. If there are more
    vehicles than clusters, some get none.

    Parameters
    ----------
    problem
        The targets, the vehicles, and the routes between them.
    clusters, targets
        The clusters, and which targets of the problem were clustered, shape (n,).

    Returns
    -------
    ndarray of shape (k,)
        The index of each cluster's vehicle.
    """
    shares = np.eye(clusters.count)[clusters.labels]
    shares /= shares.sum(axis=0)
    costs = problem.figures[COST]
    from_start = costs[np.arange(len(costs))[:, None], problem.starts[:, None], targets] @ shares
    between = shares.T @ costs[:, targets[:, None], targets] @ shares
    barred = ~problem.can_visit[:, targets] @ shares * OUT_OF_REACH * costs.max()
    owners = np.full(clusters.count, -1)
    lengths: FloatArray = from_start
    # Each round matches as many clusters as there are vehicles.
    while (left := np.flatnonzero(owners < 0)).size:
        durations = (lengths + barred) / problem.speeds_mps[:, None]
        vehicles, columns = linear_sum_assignment(durations[:, left])
        owners[left[columns]] = vehicles
        lengths = lengths.copy()
        lengths[vehicles] = between[vehicles, left[columns]]
    return owners
