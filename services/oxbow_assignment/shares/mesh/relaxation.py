"""Lloyd's relaxation: every inner point moves repeatedly to the centroid of its Voronoi cell."""

from __future__ import annotations

import numpy as np

from oxbow.arrays import FloatArray
from oxbow.geometry.triangles import cross
from oxbow_assignment.shares.mesh.triangulation import Triangulation

__all__ = ["relaxed"]


GOOD_ANGLE_RAD = np.radians(40.0)
"""A triangle whose least angle is greater than this may lose some of it in a move."""


def relaxed(mesh: Triangulation, edge_m: float, rounds: int) -> Triangulation:
    """Move inner points to the centroids of their Voronoi cells (Lloyd 1982; Du, Faber and Gunzburger 1999).

    Balampanis et al. 2016, section VIII, propose it for more homogeneous meshes. Within an obtuse triangle, whose
    circumcentre lies outside, cells meet at the middle of the longest side instead (Meyer et al. 2003, section
    3.3), so that no cell reaches over the border of the area. Next to the border, whose points are fixed,
    centroids can be too near or too far: no move may make a triangle worse that is not good.

    Parameters
    ----------
    mesh
        Where the points start from.
    edge_m
        No move may make an edge longer than this, unless the triangle had a longer one already.
    rounds
        How many times all points move.

    Returns
    -------
    Triangulation
        As many points and triangles, of the same area.
    """
    for _ in range(rounds):
        aims = np.where(mesh.border_points[:, None], mesh.points, _cell_centroids(mesh))
        mesh = _moved(mesh, aims, edge_m).legalised()
    return mesh


def _moved(mesh: Triangulation, aims: FloatArray, edge_m: float) -> Triangulation:
    """Points moved to their aims, except the corners of triangles that this would make worse."""
    least_sine, longest = mesh.least_sines, mesh.side_lengths.max(axis=1)
    # A corner that stays behind may spoil the next triangle, so this is repeated. Every round holds back at least
    # one more point, so it ends. A triangle that turns over has a negative sine and thus counts as worse.
    while True:
        there = Triangulation(aims, mesh.triangles)
        sharper = there.least_sines < np.minimum(least_sine, np.sin(GOOD_ANGLE_RAD))
        longer = there.side_lengths.max(axis=1) > np.maximum(longest, edge_m)
        worse = np.zeros(len(aims), dtype=bool)
        worse[mesh.triangles[sharper | longer]] = True
        worse &= (aims != mesh.points).any(axis=1)
        if not worse.any():
            return there
        aims = np.where(worse[:, None], mesh.points, aims)


def _cell_centroids(mesh: Triangulation) -> FloatArray:
    """The centroid of every point's cell, shape (n, 2)."""
    corners, meeting = mesh.corners, _meeting_points(mesh)
    mass = np.zeros(len(mesh.points))
    moment = np.zeros((len(mesh.points), 2))
    for k in range(3):
        corner = corners[:, k]
        for other, sign in ((k + 1, 1.0), (k + 2, -1.0)):
            middle = (corner + corners[:, other % 3]) / 2
            area = sign * cross(middle - corner, meeting - corner) / 2
            np.add.at(mass, mesh.triangles[:, k], area)
            np.add.at(moment, mesh.triangles[:, k], area[:, None] * (corner + middle + meeting) / 3)
    return np.where(mass[:, None] > 0, moment / np.where(mass > 0, mass, 1.0)[:, None], mesh.points)


def _meeting_points(mesh: Triangulation) -> FloatArray:
    """Where the three cells of a triangle meet, shape (m, 2): its circumcentre, where that lies inside."""
    corners = mesh.corners
    sides = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
    squared = (sides**2).sum(axis=2)
    # Barycentric weights of the circumcentre; the one opposite the longest side is negative in an obtuse triangle.
    weights = squared * (squared.sum(axis=1, keepdims=True) - 2 * squared)
    longest = squared.argmax(axis=1)
    obtuse = weights[np.arange(len(weights)), longest] <= 0
    weights[obtuse] = 1.0
    weights[obtuse, longest[obtuse]] = 0.0
    return np.asarray((weights[:, :, None] * corners).sum(axis=1) / weights.sum(axis=1)[:, None])
