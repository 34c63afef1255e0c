"""Paths from triangle to triangle: all of them from the border to the core, and the shortest between two.

Balampanis, Maza and Ollero 2016, Algorithms 2 and 3. These paths lead over the centroids of a mesh. They may pass
a triangle again and may cross themselves; `oxbow_path.watershed.method` has the same idea for a simple path.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from shapely import LineString

from oxbow.arrays import Indices, Mask
from oxbow.errors import InvalidRequest
from oxbow_assignment.shares.mesh import Mesh, Wavefront, propagate

__all__ = ["CellPath", "coverage_depth", "shortest_path", "watershed_path"]


@dataclass(frozen=True)
class CellPath:
    """A path over triangles, from one to a neighbour at every step.

    Parameters
    ----------
    mesh
        The mesh.
    cells : ndarray of int, shape (n,)
        The triangles in the order of passing; one that is passed again stands there again.
    """

    mesh: Mesh
    cells: Indices

    @cached_property
    def line(self) -> LineString:
        """Over centroids and the middles of the edges between them: no step leaves its two triangles."""
        here, there = self.cells[:-1], self.cells[1:]
        side = np.argmax(self.mesh.neighbours[here] == there[:, None], axis=1)
        places = np.empty((2 * len(self.cells) - 1, 2))
        places[::2], places[1::2] = self.mesh.centroids[self.cells], self.mesh.edge_middles[here, side]
        return LineString(places if len(places) > 1 else np.repeat(places, 2, axis=0))

    @property
    def length_m(self) -> float:
        """Length of the line."""
        return float(self.line.length)

    @property
    def revisits(self) -> int:
        """How many steps lead to a triangle that was passed before."""
        return len(self.cells) - len(np.unique(self.cells))


def coverage_depth(mesh: Mesh, within: Mask | None = None) -> Indices:
    """How many steps every triangle is from the border of an area (Algorithm 2, first part).

    The paper counts down from a large cost on the border; here the border's triangles have 0, their neighbours 1.

    Parameters
    ----------
    mesh
        The mesh.
    within
        The triangles of a vehicle's share, shape (m,): their neighbours outside it are its border too. All where
        absent.

    Returns
    -------
    ndarray of int, shape (m,)
        Depths; -1 outside the share.
    """
    own = np.ones(len(mesh), dtype=bool) if within is None else within
    beyond = (mesh.neighbours < 0) | ~own[mesh.neighbours]
    return propagate(mesh, np.flatnonzero(own & beyond.any(axis=1)), own).depth


def watershed_path(mesh: Mesh, start: int, within: Mask | None = None) -> CellPath:
    """Pass all triangles of a share, from its border to its core (Algorithm 2).

    From the start to the nearest triangle of the outermost level, on to the nearest of that level not passed yet,
    and so on inwards, level by level; "nearest" is between centroids, as there. Where that is no neighbour, the
    paper goes straight to it, maybe out of the area; here the path takes the shortest way over triangles of the
    share.

    Parameters
    ----------
    mesh
        The mesh.
    start
        The triangle that the path starts from.
    within
        The triangles of the vehicle's share, shape (m,); all where absent.

    Raises
    ------
    InvalidRequest
        The start is not in the share, or the share does not hang together.
    """
    own = np.ones(len(mesh), dtype=bool) if within is None else within
    if not own[start]:
        raise InvalidRequest(f"is triangle {start}; expected one of the share", where="start")
    order = list(_nearest_first(mesh, coverage_depth(mesh, own), start))
    graph = _within(mesh.graph, own)
    cells = [start]
    for cell in order:
        cells += _way(mesh, graph, cells[-1], cell)
    return CellPath(mesh, np.array(cells))


def _nearest_first(mesh: Mesh, depth: Indices, start: int) -> Iterator[int]:
    """The order of first visits, but for the start."""
    current = start
    for level in range(int(depth.max()) + 1):
        cells = np.flatnonzero(depth == level)
        cells = cells[cells != start]
        places = mesh.centroids[cells]
        left = np.ones(len(cells), dtype=bool)
        for _ in cells:
            squared = np.where(left, ((places - mesh.centroids[current]) ** 2).sum(axis=1), np.inf)
            nearest = int(np.argmin(squared))
            left[nearest] = False
            current = int(cells[nearest])
            yield current


def _within(graph: csr_array[np.float64], own: Mask) -> csr_array[np.float64]:
    """The graph without what leads out of the share; all triangles keep their numbers."""
    entries = graph.tocoo()
    kept = own[entries.row] & own[entries.col]
    return csr_array((entries.data[kept], (entries.row[kept], entries.col[kept])), shape=graph.shape)


def _way(mesh: Mesh, graph: csr_array[np.float64], start: int, goal: int) -> list[int]:
    """The shortest way over triangles, without its start."""
    if goal in mesh.neighbours[start]:
        return [goal]
    limit_m = 2 * float(np.hypot(*(mesh.centroids[goal] - mesh.centroids[start])))
    most_m = float(graph.sum())
    while True:
        distance, previous, _ = dijkstra(
            graph, indices=np.array([start]), limit=limit_m, return_predecessors=True, min_only=True
        )
        if np.isfinite(distance[goal]):
            break
        if limit_m > most_m:
            raise InvalidRequest(f"leaves triangle {goal} out of reach of triangle {start}", where="within")
        limit_m *= 4
    way = [goal]
    while previous[way[-1]] != start:
        way.append(int(previous[way[-1]]))
    return way[::-1]


def shortest_path(mesh: Mesh, waves: Wavefront, goal: int) -> CellPath:
    """The path of the fewest steps from a wavefront's start to a triangle (Algorithm 3).

    From the goal back, always to a neighbour of the same branch that is one step nearer to the start; of two, to
    the one whose centroid is nearer to the start's. No step of it leads into a dead end.

    Parameters
    ----------
    mesh, waves
        The mesh, and the wavefronts that ran over it (Algorithm 1).
    goal
        The triangle to reach.

    Raises
    ------
    InvalidRequest
        No wave reached the goal.
    """
    if waves.depth[goal] < 0:
        raise InvalidRequest(f"is triangle {goal}, which no wavefront reached", where="goal")
    start = int(np.flatnonzero((waves.source == waves.source[goal]) & (waves.depth == 0))[0])
    from_start_m = np.hypot(*(mesh.centroids - mesh.centroids[start]).T)
    cells = [goal]
    for depth in range(int(waves.depth[goal]) - 1, 0, -1):
        near = mesh.neighbours[cells[-1]]
        near = near[near >= 0]
        near = near[(waves.depth[near] == depth) & (waves.branch[near] == waves.branch[goal])]
        cells.append(int(near[np.argmin(from_start_m[near])]))
    if goal != start:
        cells.append(start)
    return CellPath(mesh, np.array(cells[::-1]))
