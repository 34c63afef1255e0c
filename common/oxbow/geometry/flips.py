"""Flips that make a triangulation constrained Delaunay (C. L. Lawson 1977)."""

from __future__ import annotations

import numpy as np

from oxbow.arrays import FloatArray, Indices
from oxbow.geometry.triangles import apexes, cross, first_claims, flipped, following
from oxbow.tolerances import ROUNDING

__all__ = ["legalised"]

FLIP_TOLERANCE = 1e-10
"""Radians by which the angles opposite a side must exceed pi in sum: below that, a flip would gain nothing."""

MAX_ROUNDS = 200
"""Rounds of flips; without a bound, rounding could make a few sides flip back and forth forever."""


def legalised(
    points: FloatArray, triangles: Indices, twins: Indices, suspects: Indices | None = None
) -> tuple[Indices, Indices]:
    """The constrained Delaunay triangulation of the same points.

    In every round, all sides that break the criterion and whose flips do not touch one another are flipped at
    once, the worst first; then those around them are examined. Sides are numbered as in
    `oxbow.geometry.triangles`.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        The vertices, in metres.
    triangles : ndarray of int, shape (m, 3)
        Corners of each, counterclockwise; left as they are.
    twins : ndarray of int, shape (3 m,)
        Every side's twin, -1 on the border, which is never flipped.
    suspects : ndarray of int, shape (k,)
        Sides that may break the criterion; all by default.

    Returns
    -------
    triangles, twins
        As given, after all flips.
    """
    scale_m2 = float(np.ptp(points, axis=0).max(initial=0.0)) ** 2
    pending = np.arange(len(twins)) if suspects is None else suspects
    for _ in range(MAX_ROUNDS):
        side = _flippable(points, triangles, twins, pending, scale_m2)
        if len(side) == 0:
            break
        now = first_claims(side // 3, twins[side] // 3)
        later, side = side[~now], side[now]
        changed = np.concatenate([side, twins[side]]) // 3
        triangles, twins = flipped(triangles, side, twins[side]), _rejoined(twins, side)
        # A flip renumbers the sides of two triangles: all of them are pending, so that no number is out of date.
        pending = np.concatenate([later, *(3 * changed + side for side in range(3))])
    return triangles, twins


def _flippable(
    points: FloatArray, triangles: Indices, twins: Indices, suspects: Indices, scale_m2: float
) -> Indices:
    """The sides among suspect ones that break the Delaunay criterion and can be flipped, the worst first."""
    side = suspects[twins[suspects] >= 0]
    side = np.unique(np.minimum(side, twins[side]))
    tail, head = points[triangles.ravel()[side]], points[triangles.ravel()[following(side)]]
    apex, beyond = points[apexes(triangles, side)], points[apexes(triangles, twins[side])]
    excess = _angle(tail - apex, head - apex) + _angle(head - beyond, tail - beyond) - np.pi
    # A flip in a quadrilateral that is not convex would turn a triangle over.
    least_new = np.minimum(cross(tail - apex, beyond - apex), cross(beyond - apex, head - apex))
    wrong = (excess > FLIP_TOLERANCE) & (least_new > -ROUNDING * scale_m2)
    return np.asarray(side[wrong][np.argsort(-excess[wrong], kind="stable")])


def _rejoined(twins: Indices, sides: Indices) -> Indices:
    """The twins after `flipped`."""
    (t, j), (u, k) = np.divmod(sides, 3), np.divmod(twins[sides], 3)
    # The four sides around each quadrilateral, by their numbers before and after.
    before = np.concatenate([3 * u + (k + 1) % 3, 3 * t + (j + 2) % 3, 3 * u + (k + 2) % 3, 3 * t + (j + 1) % 3])
    after = np.concatenate([3 * t, 3 * t + 2, 3 * u, 3 * u + 1])
    number = np.arange(len(twins))
    number[before] = after
    outer = twins[before]
    is_shared = outer >= 0
    outer[is_shared] = number[outer[is_shared]]
    twins = twins.copy()
    twins[after] = outer
    twins[outer[is_shared]] = after[is_shared]
    twins[3 * t + 1], twins[3 * u + 2] = 3 * u + 2, 3 * t + 1
    return twins


def _angle(a: FloatArray, b: FloatArray) -> FloatArray:
    """The angle between planar vectors, 0 to pi, shape (n,)."""
    return np.asarray(np.arctan2(np.abs(cross(a, b)), (a * b).sum(axis=1)))
