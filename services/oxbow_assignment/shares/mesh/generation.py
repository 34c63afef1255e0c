"""The mesh of an area: edges of about one length, and no triangle partly outside."""

from __future__ import annotations

import math

import numpy as np
import shapely
from shapely import Polygon

from oxbow.arrays import FloatArray
from oxbow.errors import InvalidRequest
from oxbow.geometry.lattice import triangular_lattice
from oxbow_assignment.shares.mesh.mesh import Mesh
from oxbow_assignment.shares.mesh.refinement import refined
from oxbow_assignment.shares.mesh.relaxation import relaxed
from oxbow_assignment.shares.mesh.triangulation import Triangulation

__all__ = ["mesh_area"]

PITCH = 0.85
"""Pitch of the lattice as a fraction of the longest edge, so that few edges become longer than allowed."""

FROM_BORDER = 0.65
"""Lattice points nearer to the border than this fraction of the pitch are left out: they would make slivers."""

RELAXATIONS = 20

GREATEST_BOUND_DEG = 30.0
"""The greatest value of `least_angle_deg`."""

MAX_TRIANGLES = 2_000_000


def mesh_area(
    area: Polygon, edge_m: float, *, least_angle_deg: float = 0.0, relaxations: int = RELAXATIONS
) -> Mesh:
    """Tile an area with triangles whose edges are about, and never more than, `edge_m` long.

    Balampanis, Maza and Ollero 2016, section IV: the mesh is a constrained Delaunay triangulation, its longest
    edge the footprint of the sensor. The paper refines it point by point with CGAL. This function divides the
    border evenly, fills the inside with an equilateral lattice, and joins the two by Lloyd's relaxation (their
    section VIII).

    Parameters
    ----------
    area
        A valid polygon, with or without holes; all its vertices become vertices of the mesh.
    edge_m
        The longest edge: the footprint of the sensor.
    least_angle_deg
        Triangles with a smaller angle are refined, except where the area's own angles and narrows enforce one;
        0 to `GREATEST_BOUND_DEG`.
    relaxations
        Rounds of Lloyd's relaxation.

    Returns
    -------
    Mesh
        Its triangles cover the area exactly.

    Raises
    ------
    InvalidRequest
        The area is empty or invalid, the edge or the angle is out of bounds, or the mesh would be far too large.
    """
    _require_fit(area, edge_m, least_angle_deg)
    # About the middle of the area: far from the origin, cross products of coordinates would lose digits.
    origin = shapely.get_coordinates(area.envelope.centroid)[0]
    local = shapely.transform(shapely.orient_polygons(area), lambda xy: xy - origin)
    border = shapely.segmentize(local, PITCH * edge_m)
    mesh = Triangulation.of(border).with_points(_lattice(local, border, PITCH * edge_m))
    # Sizes first, then relaxation, which needs about as many points as there will be; angles last, as it changes
    # them.
    mesh = relaxed(refined(mesh, edge_m, 0.0), edge_m, relaxations)
    mesh = refined(mesh, edge_m, math.radians(least_angle_deg))
    return Mesh.of(Triangulation(mesh.points + origin, mesh.triangles))


def _require_fit(area: Polygon, edge_m: float, least_angle_deg: float) -> None:
    if area.is_empty or not shapely.is_valid(area) or area.area == 0.0:
        raise InvalidRequest("is empty or not a valid polygon; expected one with an area", where="area")
    if not 0.0 < edge_m < math.inf:
        raise InvalidRequest(f"is {edge_m!r}; expected a finite number > 0.0", where="edge_m")
    if not 0.0 <= least_angle_deg <= GREATEST_BOUND_DEG:
        raise InvalidRequest(
            f"is {least_angle_deg!r}; expected 0 to {GREATEST_BOUND_DEG:g} degrees", where="least_angle_deg"
        )
    expected = 4 / math.sqrt(3) * area.area / (PITCH * edge_m) ** 2
    if expected > MAX_TRIANGLES:
        raise InvalidRequest(
            f"is {edge_m!r}, which makes about {expected:.0f} triangles; expected one that makes at most"
            f" {MAX_TRIANGLES}",
            where="edge_m",
        )


def _lattice(area: Polygon, border: Polygon, pitch_m: float) -> FloatArray:
    """Points of an equilateral lattice well inside an area, its rows along the area's longest edge."""
    ring = shapely.get_coordinates(area.exterior)
    steps = np.diff(ring, axis=0)
    longest = int(np.argmax(np.hypot(*steps.T)))
    turn = np.arctan2(steps[longest, 1], steps[longest, 0])
    along = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    upright = shapely.transform(area, lambda xy: (xy - ring[longest]) @ along.T)
    places = triangular_lattice(upright, (0.0, 0.0), pitch_m)
    places = places @ along + ring[longest]
    far = shapely.distance(shapely.points(places), border.boundary) > FROM_BORDER * pitch_m
    return np.asarray(places[far])
