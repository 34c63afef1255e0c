"""Targets as points of a space in which near means near along routes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import pdist, squareform

from oxbow.arrays import FloatArray
from oxbow.errors import InvalidRequest
from oxbow_assignment.targets.problem import require_distances

__all__ = ["PseudoCoordinates", "pseudo_coordinates"]

NOTHING = 1e-8
"""Axes with no more than this fraction of the greatest spread are left out."""


@dataclass(frozen=True)
class PseudoCoordinates:
    """Targets, placed by their distances to all targets.

    Parameters
    ----------
    places : ndarray of shape (n, d)
        Row i is target i's place, in metres. The Euclidean distance between two places is the root mean square
        of the differences of the two targets' routes to all targets; it is never more than the route between
        the two.
    distances_m : ndarray of shape (n, n)
        The distances along routes that the places were computed from.
    stress
        How badly distances between places represent those along routes: Kruskal's stress-1 after the best common
        scale, 0 for a perfect fit.
    """

    places: FloatArray
    distances_m: FloatArray
    stress: float


def pseudo_coordinates(distances: FloatArray) -> PseudoCoordinates:
    """Pseudo-coordinates of targets (Innocenti, Pollini and Bracci 2006, section 4.4).

    The columns of the cost matrix are the coordinates, as in the report. Under the norm of the largest
    difference this embeds any finite metric space without distortion (M. Fréchet, 1910);
    `clustering.mean_distances` uses that. The report leaves the norm open; these places are for the Euclidean
    norm of k-means, divided by sqrt(n), so that metres do not depend on the number of targets, and turned to
    their principal axes, which changes no distance; axes with next to no spread are left out.

    Parameters
    ----------
    distances : ndarray of shape (n, n)
        Metres along routes (or costs, danger included) between targets.

    Raises
    ------
    InvalidRequest
        No targets, or distances that are not finite or not symmetric.
    """
    require_distances(distances)
    if not len(distances) or not np.isfinite(distances).all():
        raise InvalidRequest(
            f"has shape {distances.shape}; expected finite distances of at least one target", where="distances"
        )
    columns = distances / np.sqrt(len(distances))
    centred = columns - columns.mean(axis=0)
    # `eigh` of the symmetric product rather than an SVD: rising, real, and enough for axes whose spread is not
    # tiny.
    spreads, axes = np.linalg.eigh(centred.T @ centred)
    places = centred @ axes[:, spreads >= NOTHING * spreads.max()]
    return PseudoCoordinates(places=places, distances_m=distances, stress=_stress(places, distances))


def _stress(places: FloatArray, distances: FloatArray) -> float:
    """J. B. Kruskal (1964), Psychometrika 29, with the least-squares scale of the configuration."""
    along, apart = squareform(distances, checks=False), pdist(places)
    if not apart.any():
        return 0.0
    scale = float(along @ apart) / float(apart @ apart)
    return float(np.sqrt(((along - scale * apart) ** 2).sum() / (along**2).sum()))
