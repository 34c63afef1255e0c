"""Triangles that tile an area, as arrays: how they are made, measured and numbered.

A triangulation is two arrays: points, shape (n, 2), in metres, and triangles, shape (m, 3), the corners of each
as indices into the points, counterclockwise. Side j of triangle t runs from its corner j to its corner j + 1,
opposite its corner j + 2, and has the number 3 t + j. What two triangles share are two sides, each other's twin.
Arguments that are called `corners` are coordinates, shape (m, 3, 2).
"""

from __future__ import annotations

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray, Geometries, Indices, Mask
from oxbow.tolerances import ROUNDING

__all__ = [
    "angles_rad",
    "apexes",
    "cross",
    "doubled_areas",
    "first_claims",
    "flipped",
    "following",
    "paired",
    "side_lengths",
    "spread",
    "triangulated",
    "twins_of",
]


def triangulated(faces: BaseGeometry | Geometries) -> tuple[FloatArray, Indices]:
    """The constrained Delaunay triangulation of polygons' own vertices (L. P. Chew 1989), by GEOS.

    Parameters
    ----------
    faces
        One valid region or an array of such. Where they border, they have the border's vertices in common.

    Returns
    -------
    points : ndarray, shape (n, 2)
    triangles : ndarray of int, shape (m, 3)
        Corners are never in line, except where points differ only by rounding.
    """
    points, index = np.unique(_corners(faces).reshape(-1, 2), axis=0, return_inverse=True)
    return points, _without_flats(points, index.reshape(-1, 3))


def spread(square: FloatArray, region: BaseGeometry) -> FloatArray:
    """Carry points of the unit square onto a region, equal areas onto equal areas.

    Triangles of the region are laid end to end by area. The first coordinate chooses one, and how far across it;
    the second one chooses how far along. No point is lost, however thin the region.

    Parameters
    ----------
    square : ndarray, shape (n, 2)
        Points of the unit square.
    region
        Valid polygons of positive area.

    Returns
    -------
    ndarray, shape (n, 2)
        Points of the region, in its coordinates.
    """
    corners = _corners(region)
    # Rounding may turn a sliver over: a negative area would break the order of the sums.
    areas_m2 = np.maximum(doubled_areas(corners), 0.0) / 2
    ends_m2 = np.cumsum(areas_m2)
    at_m2 = square[:, 0] * ends_m2[-1]
    # From the right: a triangle without area is passed over, and never divided by.
    chosen = np.minimum(np.searchsorted(ends_m2, at_m2, side="right"), len(ends_m2) - 1)
    left = np.clip((ends_m2[chosen] - at_m2) / areas_m2[chosen], 0.0, 1.0)
    # c is the apex, and what is left of the triangle's area shrinks towards it.
    a, b, c = np.moveaxis(corners[chosen], 1, 0)
    # The part of a triangle within a share s of its height from the apex has the share s^2 of its area.
    from_apex, along = np.sqrt(left)[:, None], square[:, 1:]
    return np.asarray((1 - from_apex) * c + from_apex * ((1 - along) * b + along * a))


def twins_of(triangles: Indices) -> Indices:
    """Every side's twin, shape (3 m,); -1 on the border."""
    one, other = paired(triangles.ravel(), np.roll(triangles, -1, axis=1).ravel())
    twins = np.full(triangles.size, -1, dtype=np.intp)
    twins[one], twins[other] = other, one
    return twins


def paired(tails: Indices, heads: Indices) -> tuple[Indices, Indices]:
    """Which sides run between the same two points.

    Parameters
    ----------
    tails, heads : ndarray of int, shape (m,)
        The points that each side runs between; no more than two sides between the same two.

    Returns
    -------
    one, other : ndarray of int, shape (k,)
        Indices into the sides: `one[i]` and `other[i]` run between the same points, either way.
    """
    key = _keys(tails, heads, max(tails.max(initial=0), heads.max(initial=0)) + 1)
    # At most two sides run between two points, so that equal keys are neighbours once sorted.
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order[1:]] == key[order[:-1]])
    return order[same], order[same + 1]


def _keys(tails: Indices, heads: Indices, count: int) -> Indices:
    """One number for each side between two of `count` points, whichever way it runs."""
    return np.asarray(np.minimum(tails, heads) * count + np.maximum(tails, heads))


def following(sides: Indices) -> Indices:
    """The next sides of the same triangles."""
    return np.asarray(sides + np.where(sides % 3 == 2, -2, 1))


def apexes(triangles: Indices, sides: Indices) -> Indices:
    """The corners opposite some sides, as indices into the points, shape (k,).

    Parameters
    ----------
    triangles : ndarray of int, shape (m, 3)
        Corners of each, as indices into the points.
    sides : ndarray of int, shape (k,)
        Numbers of sides.

    Returns
    -------
    ndarray of int, shape (k,)
        In the order of the sides. A side of -1 gives a corner of the last triangle, which means nothing.
    """
    # Corner j + 2 is corner j - 1, and index -1 the last corner.
    return np.asarray(triangles[sides // 3, sides % 3 - 1])


def flipped(triangles: Indices, sides: Indices, twins: Indices) -> Indices:
    """The triangles after some sides gave way to the other diagonal of the quadrilateral that they halve.

    Parameters
    ----------
    triangles : ndarray of int, shape (m, 3)
        Left as they are.
    sides : ndarray of int, shape (k,)
        The sides that give way. No triangle belongs to two of the pairs of a side and its twin.
    twins : ndarray of int, shape (k,)
        The twin of each of these sides; none is on the border.

    Returns
    -------
    ndarray of int, shape (m, 3)
        Of the two triangles at a side each keeps its place in the array.
    """
    (t, j), u = np.divmod(sides, 3), twins // 3
    tail, head, apex, beyond = triangles[t, j], triangles[t, j - 2], triangles[t, j - 1], apexes(triangles, twins)
    triangles = triangles.copy()
    # Both stay counterclockwise: the new diagonal runs from `beyond` to `apex`.
    triangles[t] = np.column_stack([tail, beyond, apex])
    triangles[u] = np.column_stack([beyond, head, apex])
    return triangles


def first_claims(triangles: Indices, neighbours: Indices) -> Mask:
    """Which pairs of a triangle and a neighbour share no triangle with an earlier pair.

    Parameters
    ----------
    triangles, neighbours : ndarray of int, shape (k,)
        Numbers of triangles.

    Returns
    -------
    ndarray of bool, shape (k,)
        True for the pairs that can be flipped at the same time; always true for the first.
    """
    rank = np.arange(len(triangles))
    first = np.full(max(triangles.max(initial=-1), neighbours.max(initial=-1)) + 1, len(rank))
    np.minimum.at(first, triangles, rank)
    np.minimum.at(first, neighbours, rank)
    return np.asarray((first[triangles] == rank) & (first[neighbours] == rank))


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """The cross product of plane vectors, over the last axis: positive where b lies to the left of a.

    Parameters
    ----------
    a, b : ndarray, shape (..., 2)
        Shapes that broadcast.

    Returns
    -------
    ndarray of float
        Of the shape of the arguments without their last axis, in the product of their units.
    """
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def doubled_areas(corners: FloatArray) -> FloatArray:
    """Twice the area of each triangle, shape (m,), in m2; negative where it is turned over."""
    return cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def side_lengths(corners: FloatArray) -> FloatArray:
    """The length of each side, shape (m, 3), in metres."""
    along = np.roll(corners, -1, axis=1) - corners
    return np.asarray(np.hypot(along[..., 0], along[..., 1]))


def angles_rad(corners: FloatArray) -> FloatArray:
    """The angle at each corner, shape (m, 3)."""
    # arctan2, since the arccosine loses half the digits near 0 and half a turn.
    ahead, behind = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    return np.asarray(np.arctan2(cross(ahead, behind), (ahead * behind).sum(axis=2)))


def _corners(faces: BaseGeometry | Geometries) -> FloatArray:
    """The triangles of polygons, shape (m, 3, 2), counterclockwise."""
    parts = shapely.get_parts(shapely.get_parts(shapely.constrained_delaunay_triangles(faces)))
    # GEOS goes round them clockwise.
    return np.asarray(shapely.get_coordinates(parts).reshape(-1, 4, 2)[:, 2::-1])


def _without_flats(points: FloatArray, triangles: Indices) -> Indices:
    """Triangles without those of no height, which points in line make.

    A flat triangle's longest side is flipped, longer ones before their neighbours, so that flips do not undo one
    another. One whose longest side is on the border is dropped: it has no area. A needle, two corners of which
    differ only by rounding, has two longest sides, and none to flip. Near needles stay flat whichever side is
    flipped, and rounding decides which of their sides is the longest: a side that has been flipped away does not
    come back, or two of them could flip one side to and fro for ever.
    """
    # Coordinates far from the origin carry fewer decimals: what counts as flat grows with them.
    rounding_m = ROUNDING * float(np.abs(points).max(initial=0.0))
    gone = np.empty(0, dtype=np.intp)
    # Ends: each round drops a triangle, or flips sides that may not come back, of which there are finitely many.
    while True:
        twins, lengths = twins_of(triangles), side_lengths(points[triangles])
        longest = lengths.max(axis=1, keepdims=True)
        flat = doubled_areas(points[triangles]) <= rounding_m * longest[:, 0]
        at_border = (twins.reshape(-1, 3) < 0) & (lengths >= longest - 2 * rounding_m)
        lost = flat & at_border.any(axis=1)
        if lost.any():
            triangles = triangles[~lost]
            continue
        caps = np.flatnonzero(flat & (lengths.min(axis=1) > 2 * rounding_m))
        caps = caps[np.argsort(-longest[caps, 0], kind="stable")]
        sides = 3 * caps + np.argmax(lengths[caps], axis=1)
        after = _keys(apexes(triangles, sides), apexes(triangles, twins[sides]), len(points))
        sides = sides[~np.isin(after, gone)]
        if len(sides) == 0:
            return triangles
        # Flips of one round are made at once, so that no two of them may share a triangle.
        sides = sides[first_claims(sides // 3, twins[sides] // 3)]
        before = _keys(triangles.ravel()[sides], triangles.ravel()[following(sides)], len(points))
        gone = np.append(gone, before)
        triangles = flipped(triangles, sides, twins[sides])
