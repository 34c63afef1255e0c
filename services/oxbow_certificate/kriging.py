"""How well a field can be reconstructed from samples along a path: the kriging variance.

Rendas and Li 2016, section 1.2, second approach: where a stochastic model of the field is known, the discrepancy
between the true and the reconstructed field is replaced by its expected value. With a variogram and an unknown
mean, the best linear reconstruction is ordinary kriging (Matheron 1963; Cressie 1993, section 3.2). Its expected
squared error at a place depends on where the field is sampled, not on the values: it is known in advance.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import KDTree
from shapely import LineString

from oxbow.arrays import FloatArray, Mask
from oxbow.contracts import Variogram, VariogramModel
from oxbow_certificate.axes import Paths

__all__ = [
    "KrigingVariance",
    "correlation",
    "kriging_variance",
    "local_variance",
    "sample_positions",
    "sampling_pitch",
]

PITCH = 0.1
"""The greatest distance of samples along a path, as a fraction of the variogram's range."""
MOST_SAMPLES = 200_000
NEAREST, SPREAD = 20, 12
"""Samples from which the field at a place is reconstructed: see `local_variance`."""
LEAST_NUGGET = 1e-9
"""A fraction of the sill: it keeps the equations regular where a smooth field is sampled densely."""
_CHUNK = 1_000

_TWENTYFOLD = math.log(20.0)
_MATERN32 = 4.743864518390577
"""Where (1 + x) exp(-x) = 0.05."""

_CORRELATIONS: dict[VariogramModel, Callable[[FloatArray], FloatArray]] = {
    VariogramModel.EXPONENTIAL: lambda h: np.exp(-_TWENTYFOLD * h),
    VariogramModel.SPHERICAL: lambda h: np.where(h < 1.0, 1.0 - 1.5 * h + 0.5 * h**3, 0.0),
    VariogramModel.GAUSSIAN: lambda h: np.exp(-_TWENTYFOLD * h**2),
    VariogramModel.MATERN32: lambda h: (1.0 + _MATERN32 * h) * np.exp(-_MATERN32 * h),
}
"""Correlation by distance / range: 0.05 at 1, or 0 in the spherical model."""


@dataclass(frozen=True)
class KrigingVariance:
    """Mean and maximum over a region of the kriging variance, as fractions of the sill."""

    mean: float
    max: float


def kriging_variance(
    paths: Paths, places: FloatArray, variogram: Variogram, least_radius_m: float
) -> KrigingVariance:
    """The kriging variance of a field sampled along paths.

    Parameters
    ----------
    paths
        Where the field is sampled.
    places : ndarray of shape (n, 2)
        Where it is reconstructed: places spread evenly over a region.
    variogram
        How the field varies.
    least_radius_m
        The least cover radius that paths of this length could have over the region; see `least_radius`.

    Returns
    -------
    KrigingVariance
        Fractions of the sill. Far from all samples it is a little more than 1, since the mean is unknown too.
    """
    pitch_m = sampling_pitch(variogram, paths, least_radius_m)
    samples = np.concatenate([sample_positions(path, pitch_m) for path in shapely.get_parts(paths)])
    variances = local_variance(samples, places, variogram)
    return KrigingVariance(mean=float(variances.mean()), max=float(variances.max()))


def sampling_pitch(variogram: Variogram, paths: Paths, least_radius_m: float) -> float:
    """How far apart to sample paths, in metres: finely for the range, and no more coarsely along legs than across.

    Vehicles sample more often. Their additional samples would change little, and only for the better.

    Parameters
    ----------
    variogram
        How the field varies.
    paths
        Where it is sampled, at no more than about `MOST_SAMPLES` positions.
    least_radius_m
        The least cover radius of paths of this length: half the spacing of ideal legs.

    Returns
    -------
    float
        In metres; more where a path is so long that it would have more than `MOST_SAMPLES`.
    """
    return max(min(PITCH * variogram.range_m, least_radius_m), paths.length / MOST_SAMPLES)


def sample_positions(path: LineString, pitch_m: float) -> FloatArray:
    """Positions at equal distances along a path, both ends among them, shape (n, 2).

    Parameters
    ----------
    path
        The path; of positive length.
    pitch_m
        The greatest distance between positions.

    Returns
    -------
    ndarray, shape (n, 2)
        In metres, in the order of the path, at least two.
    """
    xy = shapely.get_coordinates(path)
    at = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])
    samples = np.linspace(0.0, at[-1], math.ceil(at[-1] / pitch_m) + 1)
    return np.column_stack([np.interp(samples, at, xy[:, 0]), np.interp(samples, at, xy[:, 1])])


def correlation(variogram: Variogram, distance_m: FloatArray) -> FloatArray:
    """Covariance of the field at two places, as a fraction of the sill.

    The nugget is lost between any two samples, even of one place.

    Parameters
    ----------
    variogram
        How the field varies.
    distance_m
        Between the two places, of any shape.

    Returns
    -------
    ndarray
        Of the shape of `distance_m`.
    """
    nugget = max(variogram.nugget / variogram.sill, LEAST_NUGGET)
    return (1.0 - nugget) * _CORRELATIONS[variogram.model](distance_m / variogram.range_m)


def local_variance(samples: FloatArray, places: FloatArray, variogram: Variogram) -> FloatArray:
    """Ordinary kriging variance at places, each from a few samples; as a fraction of the sill, shape (n,).

    These are the nearest samples, which screen off those behind them, and some spread over all, which determine
    the field's mean. Additional samples could only lower the variance, so it is never underestimated.

    Parameters
    ----------
    samples : ndarray of shape (m, 2)
        Where the field is sampled.
    places : ndarray of shape (n, 2)
        Where it is reconstructed.
    variogram
        How it varies.

    Returns
    -------
    ndarray, shape (n,)
        Fractions of the sill, in the order of the places.
    """
    tree = KDTree(samples)
    nearest = np.arange(1, min(NEAREST, len(samples)) + 1)
    # By number along the path, and so by length: the same ones for every place.
    spread = np.linspace(0, len(samples), SPREAD, endpoint=False, dtype=np.intp)
    variances = []
    for chunk in np.split(places, range(_CHUNK, len(places), _CHUNK)):
        near_m, near = map(np.asarray, tree.query(chunk, k=nearest))
        used = samples[np.concatenate([near, np.broadcast_to(spread, (len(chunk), SPREAD))], axis=1)]
        distance_m = np.linalg.norm(used - chunk[:, None], axis=2)
        # A spread sample as near as the nearest ones may be one of them; two equal rows would make C singular.
        counts = distance_m > near_m[:, -1:]
        counts[:, : len(nearest)] = True
        variances.append(_variance(used, distance_m, counts, variogram))
    return np.concatenate(variances)


def _variance(samples: FloatArray, distance_m: FloatArray, counts: Mask, variogram: Variogram) -> FloatArray:
    """Variances (n,) at places from k samples each.

    The weights w minimise 1 - 2 w.c + w.C w where they sum to 1; C is the correlation of the samples with one
    another, c theirs with the place.

    Parameters
    ----------
    samples : ndarray of shape (n, k, 2)
        Their positions.
    distance_m : ndarray of shape (n, k)
        From each to its place.
    counts : ndarray of shape (n, k)
        False for a sample that may be a duplicate; it gets no weight.
    variogram
        How the field varies.
    """
    x, y = samples[:, :, 0], samples[:, :, 1]
    apart_m = np.hypot(x[:, :, None] - x[:, None], y[:, :, None] - y[:, None])
    # A sample that does not count keeps its row, as one of a field of its own: its weight comes out 0, and all
    # places have systems of one size, which are solved together.
    among = correlation(variogram, apart_m) * counts[:, :, None] * counts[:, None]
    diagonal = np.arange(samples.shape[1])
    among[:, diagonal, diagonal] = 1.0
    towards = correlation(variogram, distance_m) * counts
    simple, unit = np.moveaxis(np.linalg.solve(among, np.stack([towards, counts], axis=2)), 2, 0)
    # The unknown mean adds a Lagrange multiplier; eliminated by hand, it takes a second right-hand side and no
    # more.
    weights = simple + unit * ((1.0 - simple.sum(axis=1)) / unit.sum(axis=1))[:, None]
    # This is the variance of the weights found. The shorter formula, which holds for the best weights alone, could
    # come out negative by rounding.
    between = np.einsum("ni,nij,nj->n", weights, among, weights)
    return np.asarray(1.0 - 2.0 * (weights * towards).sum(axis=1) + between)
