"""The Reeb graph of a decomposition, and its cells as polygons."""

from __future__ import annotations

import networkx as nx
import numpy as np
from shapely import Polygon

from oxbow.contracts import Cell, Decomposition

__all__ = ["cell_polygon", "reeb_graph"]


def reeb_graph(decomposition: Decomposition) -> nx.MultiGraph[int]:
    """The Reeb graph of the free space (Rendas and Li 2016, section 1.2.1.1, step 2).

    Parameters
    ----------
    decomposition
        Cells and the critical points between them.

    Returns
    -------
    networkx.MultiGraph
        Nodes are indices into `critical_points`, with their `kind` and planar `place`; edges are the
        cells, with the cell's index as key and as attribute `cell`. Two cells on either side of an island
        may join the same pair of critical points, hence a multigraph. It has one independent cycle for each
        island that water surrounds.
    """
    graph: nx.MultiGraph[int] = nx.MultiGraph()
    for number, point in enumerate(decomposition.critical_points):
        graph.add_node(number, kind=point.kind, place=point.place)
    for number, cell in enumerate(decomposition.cells):
        graph.add_edge(cell.start, cell.end, key=number, cell=number)
    return graph


def cell_polygon(cell: Cell) -> Polygon:
    """The cell's outline in the sweep frame; empty where the cell has no width.

    A cell between two critical points of equal u has no width and no area: it is in the decomposition because the
    Reeb graph needs it.
    """
    if cell.floor[0, 0] == cell.floor[-1, 0]:
        return Polygon()
    return Polygon(np.concatenate([cell.floor, cell.ceiling[::-1]]))
