"""Probe points of the free space, and their distances to a path."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray, Indices
from oxbow.geometry.lattice import lattice_within

__all__ = ["Probe", "all_within_reach"]


@dataclass(frozen=True)
class Probe:
    """A grid over the free space and its shore, `pitch_m` apart.

    Distances measured on it err by at most `pitch_m` in all: half a cell's diagonal between its points, and an
    eighth of the pitch for the path, which is walked in small steps.
    """

    points: FloatArray
    pitch_m: float

    @classmethod
    def over(cls, free: Polygon, pitch_m: float) -> Probe:
        """Cover `free` by a grid, and its shore by points as dense.

        Parameters
        ----------
        free
            The free space.
        pitch_m
            Distance of neighbouring points of the grid, and the largest along the shore.

        Returns
        -------
        Probe
            With the points of the grid first, then those on the shore.
        """
        x0, y0, *_ = free.bounds
        inside = lattice_within(free, (x0 + pitch_m / 2, y0 + pitch_m / 2), pitch_m, pitch_m)
        shore = shapely.get_coordinates(shapely.segmentize(free.boundary, pitch_m))
        return cls(np.vstack([inside, shore]), pitch_m)

    @cached_property
    def _tree(self) -> shapely.STRtree:
        return shapely.STRtree(np.asarray(shapely.points(self.points)))

    def within(self, area: Polygon) -> Indices:
        """Indices of the points inside an area."""
        return self._tree.query(area, predicate="contains")

    def steps(self, lines: Iterable[BaseGeometry]) -> tuple[FloatArray, Indices]:
        """Points along lines, no farther apart than a quarter of the pitch, and the number of the line of each."""
        return shapely.get_coordinates(
            shapely.segmentize(np.asarray(list(lines)), self.pitch_m / 4), return_index=True
        )

    def distances(self, line: BaseGeometry) -> FloatArray:
        """Distance of every probe point to a line, shape (n,)."""
        steps, _ = self.steps([line])
        # Each tree is queried once: to balance it takes longer than it saves.
        distance, _ = cKDTree(steps, balanced_tree=False, compact_nodes=False).query(self.points)
        return np.asarray(distance)


def all_within_reach(points: FloatArray, steps: FloatArray, reach_m: float) -> bool:
    """Whether every point has a step within reach.

    Parameters
    ----------
    points
        What has to be covered, shape (n, 2), in metres.
    steps
        What covers it, shape (m, 2): points along a path.
    reach_m
        The largest distance from a point to its nearest step, itself within reach.

    Returns
    -------
    bool
        True without points, False with points and no steps.
    """
    if len(points) == 0:
        return True
    if len(steps) == 0:
        return False
    # The tree leaves out what is exactly at its upper bound.
    distance, _ = cKDTree(steps).query(points, distance_upper_bound=np.nextafter(reach_m, np.inf))
    return bool(np.isfinite(distance).all())
