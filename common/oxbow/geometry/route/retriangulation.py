"""Local changes of a triangulation.

M. Kallmann, H. Bieri and D. Thalmann (2003), *Fully dynamic constrained Delaunay triangulations*: only triangles
that a change affects are rebuilt. They insert vertices and edges one by one; this module removes the triangles
that meet the change as one cavity, lets GEOS triangulate it, and from its border C. L. Lawson's flips (1977) go
on outwards until everything is constrained Delaunay again.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import shapely
from shapely import STRtree
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray, Geometries, Indices, Mask
from oxbow.geometry.flips import legalised
from oxbow.geometry.route.mesh import WaterMesh
from oxbow.geometry.triangles import following, paired, triangulated, twins_of
from oxbow.tolerances import ROUNDING_M

__all__ = ["GRID_M", "ChangedWater", "retriangulated"]

GRID_M = 2.0**-20
"""All vertices lie on a grid this fine (about 1 micrometre), so that a part cut out fits again when put back."""


class ChangedWater(Protocol):
    """The water as it should be after a change."""

    def shores_near(self, areas: Geometries) -> Geometries:
        """All lines along which water may end that come within rounding of areas; some may run over land."""

    def is_water(self, places: FloatArray) -> Mask:
        """Whether places, shape (n, 2), are in the water."""


def retriangulated(mesh: WaterMesh, changed: BaseGeometry, water: ChangedWater) -> WaterMesh:
    """The mesh after a change.

    Parameters
    ----------
    mesh
        The water before, on the grid.
    changed
        Where water has appeared or disappeared; on the grid.
    water
        The water afterwards, which differs only there.

    Returns
    -------
    WaterMesh
        A new mesh, constrained Delaunay; the one given is unchanged. It has no triangles where no water is left.
    """
    cavity = _touched(mesh, changed)
    while True:
        faces = _hole(mesh, cavity, changed, water)
        splice, loose = _spliced(mesh, cavity, faces)
        if not len(loose):
            return splice.legalised()
        # A new vertex fell on the cavity's border: the triangles beyond have to take it in.
        # The cavity only grows, and the mesh is finite: this ends.
        cavity = np.union1d(cavity, loose)


def _hole(mesh: WaterMesh, cavity: Indices, changed: BaseGeometry, water: ChangedWater) -> Geometries:
    """The water of a cavity after the change, as polygons.

    All lines are noded together, with the shores as they were given, not as earlier changes cut them: what
    rounding did to a shore is undone when the obstacle that was there leaves.
    """
    pieces = np.asarray(shapely.polygons(mesh.corners[cavity]))
    border = mesh.twins.reshape(-1, 3)[cavity].ravel()
    border = border[(border >= 0) & ~np.isin(border // 3, cavity)]
    # Sides that were shore are not among them: the shores of after the change come from the water as it is then.
    ends = np.stack([mesh.tails[border], mesh.heads[border]], axis=1)
    parts = shapely.get_parts(shapely.geometrycollections([changed, *pieces]))
    lines = np.concatenate([shapely.linestrings(ends), water.shores_near(parts)])
    noded = shapely.union_all(lines, grid_size=GRID_M)
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    middles = shapely.point_on_surface(faces)
    inside = np.zeros(len(faces), dtype=np.bool_)
    inside[STRtree(middles).query(parts, predicate="intersects")[1]] = True
    inside[inside] = water.is_water(shapely.get_coordinates(middles[inside]))
    return np.asarray(faces[inside])


def _touched(mesh: WaterMesh, area: BaseGeometry) -> Indices:
    """The triangles that meet an area, or did before vertices on its outline were rounded."""
    low, high = np.reshape(area.bounds, (2, 2)) + np.array([[-ROUNDING_M], [ROUNDING_M]])
    # On which sides of the area's box a vertex lies, as in D. Cohen and I. Sutherland's clipping.
    outside = np.hstack([mesh.points < low, mesh.points > high]) @ np.array([1, 2, 4, 8], dtype=np.uint8)
    near = np.flatnonzero(np.bitwise_and.reduce(outside[mesh.triangles.T]) == 0)
    triangles = shapely.polygons(mesh.corners[near])
    return np.asarray(near[shapely.dwithin(area, triangles, ROUNDING_M)])


def _spliced(mesh: WaterMesh, cavity: Indices, faces: Geometries) -> tuple[_Splice, Indices]:
    """The mesh with another triangulation in a cavity, and the triangles outside to which that does not fit."""
    places, fresh = triangulated(faces)
    points, number = _numbered(mesh, cavity, places)
    kept = np.ones(len(mesh.triangles), dtype=np.bool_)
    kept[cavity] = False
    rank = np.where(kept, np.cumsum(kept) - 1, -1)
    border = mesh.twins.reshape(-1, 3)[cavity].ravel()
    border = border[(border >= 0) & kept[border // 3]]
    # Kept triangles come first, under new numbers; those of the cavity follow.
    first = 3 * np.count_nonzero(kept)
    fresh_twins = twins_of(fresh)
    triangles = np.vstack([mesh.triangles[kept], number[fresh]])
    kept_twins = _renumbered(mesh.twins[np.repeat(kept, 3)], rank)
    twins = np.concatenate([kept_twins, np.where(fresh_twins >= 0, fresh_twins + first, -1)])
    # Then both are sewn together along the cavity's border, where they run between the same two vertices.
    outer = _renumbered(border, rank)
    open_sides = np.concatenate([outer, first + np.flatnonzero(fresh_twins < 0)])
    one, other = paired(triangles.ravel()[open_sides], triangles.ravel()[following(open_sides)])
    one, other = open_sides[one], open_sides[other]
    twins[one], twins[other] = other, one
    loose = border[twins[outer] < 0] // 3
    return _Splice(points, triangles, twins, outer), loose


def _numbered(mesh: WaterMesh, cavity: Indices, places: FloatArray) -> tuple[FloatArray, Indices]:
    """All vertices, and the numbers of places among them: those that the cavity had keep theirs."""
    old = np.unique(mesh.triangles[cavity])
    # Exact comparison is safe: old and new vertices lie on one grid.
    number = {place: int(vertex) for place, vertex in zip(map(tuple, mesh.points[old].tolist()), old, strict=True)}
    new = [place for place in map(tuple, places.tolist()) if place not in number]
    number |= {place: len(mesh.points) + rank for rank, place in enumerate(new)}
    points = np.vstack([mesh.points, np.reshape(new, (-1, 2))])
    return points, np.array([number[place] for place in map(tuple, places.tolist())], dtype=np.intp)


def _renumbered(sides: Indices, rank: Indices) -> Indices:
    """Sides after their triangles have new numbers; -1 where the triangle is gone or the side was shore."""
    triangle = rank[sides // 3]
    return np.where((sides >= 0) & (triangle >= 0), 3 * triangle + sides % 3, -1)


@dataclass(frozen=True)
class _Splice:
    """A triangulation that may not be Delaunay at some sides."""

    points: FloatArray
    triangles: Indices
    twins: Indices
    suspects: Indices

    def legalised(self) -> WaterMesh:
        """The constrained Delaunay triangulation that flips lead to; without vertices that no triangle has."""
        triangles, twins = legalised(self.points, self.triangles, self.twins, self.suspects)
        used = np.zeros(len(self.points), dtype=np.bool_)
        used[triangles] = True
        return WaterMesh(self.points[used], (np.cumsum(used) - 1)[triangles], twins)
