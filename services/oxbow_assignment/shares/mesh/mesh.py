"""A triangular mesh: its triangles, who is whose neighbour, and how even it is."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from shapely import Polygon

from oxbow.arrays import FloatArray, Geometries, Indices, Mask
from oxbow.geometry.triangles import angles_rad, doubled_areas, side_lengths
from oxbow_assignment.shares.mesh.triangulation import Triangulation

__all__ = ["AngleStatistics", "Mesh"]


@dataclass(frozen=True)
class AngleStatistics:
    """How even a mesh is (Balampanis, Maza and Ollero 2016, Table I); angles are 60 degrees at best.

    Parameters
    ----------
    least_deg, low_deg, mean_least_deg
        The least angle of all, the 1st percentile over triangles of their least angle, and its mean.
    greatest_deg
        The greatest angle of all.
    shortest_edge_m, mean_edge_m, longest_edge_m
        Lengths of edges.
    """

    least_deg: float
    low_deg: float
    mean_least_deg: float
    greatest_deg: float
    shortest_edge_m: float
    mean_edge_m: float
    longest_edge_m: float


@dataclass(frozen=True)
class Mesh:
    """Triangles that tile an area: none reaches out of it, none overlaps another, and none is missing.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        The vertices, in planar metres.
    triangles : ndarray of int, shape (m, 3)
        Vertices of every triangle, counterclockwise.
    neighbours : ndarray of int, shape (m, 3)
        ``neighbours[t, j]`` is the triangle beyond side j of triangle t (`oxbow.geometry.triangles`); -1 beyond
        the border.
    """

    points: FloatArray
    triangles: Indices
    neighbours: Indices

    @classmethod
    def of(cls, triangulation: Triangulation) -> Mesh:
        """The mesh of a triangulation, without points that no triangle uses."""
        used, index = np.unique(triangulation.triangles, return_inverse=True)
        twins = triangulation.twins.reshape(-1, 3)
        return cls(triangulation.points[used], index.reshape(-1, 3), np.where(twins >= 0, twins // 3, -1))

    def __len__(self) -> int:
        return len(self.triangles)

    @cached_property
    def corners(self) -> FloatArray:
        """Coordinates of the corners, shape (m, 3, 2)."""
        return self.points[self.triangles]

    @cached_property
    def centroids(self) -> FloatArray:
        """Shape (m, 2): the waypoints of Balampanis et al. 2016, section VI."""
        return np.asarray(self.corners.mean(axis=1))

    @cached_property
    def areas_m2(self) -> FloatArray:
        """Area of every triangle, shape (m,)."""
        return doubled_areas(self.corners) / 2

    @cached_property
    def edge_lengths_m(self) -> FloatArray:
        """Length of each side, shape (m, 3)."""
        return side_lengths(self.corners)

    @cached_property
    def edge_middles(self) -> FloatArray:
        """The middle of each side, shape (m, 3, 2)."""
        return (self.corners + np.roll(self.corners, -1, axis=1)) / 2

    @cached_property
    def angles_rad(self) -> FloatArray:
        """Angle at each corner, shape (m, 3)."""
        return angles_rad(self.corners)

    @cached_property
    def angle_statistics(self) -> AngleStatistics:
        """See `AngleStatistics`."""
        angles = np.degrees(self.angles_rad)
        least, lengths = angles.min(axis=1), self.edge_lengths_m
        # An edge that two triangles share counts once.
        once = (self.neighbours < 0) | (self.neighbours > np.arange(len(self))[:, None])
        return AngleStatistics(
            least_deg=float(least.min()),
            low_deg=float(np.quantile(least, 0.01)),
            mean_least_deg=float(least.mean()),
            greatest_deg=float(angles.max()),
            shortest_edge_m=float(lengths.min()),
            mean_edge_m=float(lengths[once].mean()),
            longest_edge_m=float(lengths.max()),
        )

    @cached_property
    def polygons(self) -> Geometries:
        """Every triangle as a shapely polygon, shape (m,)."""
        return np.asarray(shapely.polygons(self.corners), dtype=object)

    @cached_property
    def graph(self) -> csr_array[np.float64]:
        """Neighbouring triangles, and the way from one's centroid to the other's over the middle of their edge."""
        triangle, side = np.nonzero(self.neighbours >= 0)
        half = np.hypot(*(self.centroids[triangle] - self.edge_middles[triangle, side]).T)
        one_way = csr_array((half, (triangle, self.neighbours[triangle, side])), shape=(len(self), len(self)))
        return csr_array(one_way + one_way.T)

    @cached_property
    def pieces(self) -> Indices:
        """The number of the connected piece that each triangle belongs to, shape (m,)."""
        return np.asarray(connected_components(self.graph, directed=False)[1])

    def part(self, which: Mask) -> Mesh:
        """Some of the triangles, as a mesh of their own; in the same order."""
        # The last entry answers for a neighbour of -1, which indexes it from the end.
        rank = np.append(np.where(which, np.cumsum(which) - 1, -1), -1)
        return Mesh(self.points, self.triangles[which], rank[self.neighbours[which]])

    def subdivided(self) -> Mesh:
        """Every triangle t divided in four of its shape, 4 t to 4 t + 3, at the middles of its edges."""
        ends = np.stack([self.triangles, np.roll(self.triangles, -1, axis=1)], axis=2).reshape(-1, 2)
        edges, index = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
        a, b, c = self.triangles.T
        ab, bc, ca = (len(self.points) + index.reshape(-1, 3)).T
        quarters = [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
        triangles = np.moveaxis(np.array(quarters), 2, 0).reshape(-1, 3)
        return Mesh.of(Triangulation(np.vstack([self.points, self.points[edges].mean(axis=1)]), triangles))

    def located(self, places: FloatArray) -> Indices:
        """The triangle that holds each place, shape (n,), or else the nearest one."""
        tree = shapely.STRtree(self.polygons)
        _, triangle = tree.query_nearest(shapely.points(np.atleast_2d(places)), all_matches=False)
        return np.asarray(triangle)

    def region(self, which: Mask) -> Polygon:
        """The union of some triangles that are connected by edges; exact, since no coordinate is computed anew."""
        # Triangles of a mesh share edges exactly, which a coverage union relies on: far quicker, and without new
        # points.
        merged = shapely.coverage_union_all(self.polygons[which])
        assert isinstance(merged, Polygon), "these triangles are not connected"
        return merged
