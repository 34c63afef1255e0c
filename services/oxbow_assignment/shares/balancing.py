"""Balancing: triangles change hands along the borders of shares until every share has what is due to it.

Balampanis, Maza and Ollero 2016, section VIII, propose to exchange border cells between vehicles. Exchanged one by
one, these make ragged borders and cut shares in two. This module instead spreads a potential over the giver's
share: 0 beyond its border with the taker, 1 in its farthest triangle, and harmonic between. By the maximum
principle every triangle has a neighbour of lower and one of higher potential, so that the part below any level is
connected to the taker, and the part above it to the farthest triangle. The level is chosen by area. Level lines of
a harmonic function are short and run across narrows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import networkx as nx
import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.sparse.linalg import spsolve

from oxbow.arrays import FloatArray, Indices, Mask
from oxbow_assignment.shares.mesh import Mesh

__all__ = ["balanced_shares", "border_lengths_m", "imbalance"]


TOLERANCE = 0.01
"""Shares that deviate from what is due by no more than this fraction are left as they are."""

TRANSFERS = 6
"""At most this many transfers per share."""

TRIES = 4
"""How many farthest triangles are tried in one transfer."""


def imbalance(areas_m2: FloatArray, due_m2: FloatArray) -> float:
    """The greatest relative deviation of a share from what is due to it.

    Parameters
    ----------
    areas_m2
        The area of every share, shape (k,).
    due_m2
        The area due to every share, > 0, shape (k,).

    Returns
    -------
    float
        0 where all have what is due.
    """
    return float(np.abs(areas_m2 / due_m2 - 1.0).max())


def border_lengths_m(mesh: Mesh, share: Indices, count: int) -> FloatArray:
    """Length of the border between every two shares, in metres, shape (count, count); symmetric.

    Parameters
    ----------
    mesh
        The mesh.
    share
        The share of every triangle, 0 to `count` - 1, shape (m,).
    count
        The number of shares.

    Returns
    -------
    ndarray of float, shape (count, count)
        In metres; 0 where two shares do not touch, and on the diagonal.
    """
    triangle, side = np.nonzero((mesh.neighbours >= 0) & (share[mesh.neighbours] != share[:, None]))
    lengths = np.zeros((count, count))
    pair = (share[triangle], share[mesh.neighbours[triangle, side]])
    np.add.at(lengths, pair, mesh.edge_lengths_m[triangle, side])
    return lengths


def balanced_shares(mesh: Mesh, share: Indices, due_m2: FloatArray, allowed: Mask) -> Indices:
    """Shares, each connected, whose areas are nearer to what is due.

    Parameters
    ----------
    mesh
        The mesh.
    share
        The share of every triangle, shape (m,); every share is connected.
    due_m2
        The area due to each share, shape (k,); they sum to the area of the mesh.
    allowed : ndarray of bool, shape (k, m)
        Which triangles each share may take.

    Returns
    -------
    ndarray of int, shape (m,)
        The share of every triangle; areas are within `TOLERANCE` of what is due where the triangles allow it.
    """
    count = len(due_m2)
    least, since = np.inf, 0
    for _ in range(TRANSFERS * count):
        areas = np.bincount(share, mesh.areas_m2, minlength=count).astype(float)
        uneven = imbalance(areas, due_m2)
        # A transfer down the tree may worsen the balance before the next one mends it: as many rounds as there are
        # shares may pass without progress.
        least, since = (uneven, 0) if uneven < least else (least, since + 1)
        if uneven <= TOLERANCE or since > count:
            break
        least_m2 = TOLERANCE * float(due_m2.min()) / 2
        for giver, taker, area_m2 in _transfers(mesh, share, areas - due_m2, least_m2):
            moved = _Giver.of(mesh, share, giver, taker, allowed).part(area_m2, least_m2)
            if moved.any():
                share = np.where(moved, taker, share)
                break
        else:
            break
    return share


def _transfers(
    mesh: Mesh, share: Indices, surplus_m2: FloatArray, least_m2: float
) -> list[tuple[int, int, float]]:
    """Giver, taker and area of the transfers that may be made next, the largest first.

    Over a tree of neighbours the flows are determined; the tree joins shares where their borders are longest. A
    share gives only once it has received all that it is to receive.
    """
    lengths = border_lengths_m(mesh, share, len(surplus_m2))
    neighbours: nx.Graph[int] = nx.from_numpy_array(lengths)
    # Along the longest borders: there a transfer changes the shapes least.
    tree = nx.maximum_spanning_tree(neighbours)
    transfers: list[tuple[int, int, float]] = []
    for one, other in tree.edges:
        rest = tree.copy()
        rest.remove_edge(one, other)
        flow_m2 = float(surplus_m2[list(nx.node_connected_component(rest, one))].sum())
        if abs(flow_m2) > least_m2:
            # What is on one side of the edge has too much in all: that much has to cross it.
            transfers.append((one, other, flow_m2) if flow_m2 > 0 else (other, one, -flow_m2))
    takers = {taker for _, taker, _ in transfers}
    ready = [transfer for transfer in transfers if transfer[0] not in takers]
    return sorted(ready, key=lambda transfer: -transfer[2])


@dataclass(frozen=True)
class _Giver:
    """A share that gives to a neighbour; its triangles are renumbered from 0 to n - 1.

    Parameters
    ----------
    mesh, triangles
        The mesh, and the numbers there of the share's triangles, shape (n,).
    conductances
        Between its triangles: length of their edge over distance of their centroids, shape (n, n).
    outlets
        The same towards the taker, shape (n,).
    owned, barred
        Which of the triangles the giver may have, and which the taker must not have, shape (n,).
    """

    mesh: Mesh
    triangles: Indices
    conductances: csr_array[np.float64]
    outlets: FloatArray
    owned: Mask
    barred: Mask

    @classmethod
    def of(cls, mesh: Mesh, share: Indices, giver: int, taker: int, allowed: Mask) -> _Giver:
        triangles = np.flatnonzero(share == giver)
        number = np.full(len(mesh) + 1, -1)
        number[triangles] = np.arange(len(triangles))
        row, side = np.nonzero(mesh.neighbours[triangles] >= 0)
        here, there = triangles[row], mesh.neighbours[triangles[row], side]
        conductance = mesh.edge_lengths_m[here, side] / np.hypot(*(mesh.centroids[here] - mesh.centroids[there]).T)
        own, outward = share[there] == giver, share[there] == taker
        size = len(triangles)
        inner = coo_array((conductance[own], (row[own], number[there[own]])), shape=(size, size))
        outlets = np.bincount(row[outward], conductance[outward], minlength=size).astype(float)
        return cls(mesh, triangles, inner.tocsr(), outlets, allowed[giver, triangles], ~allowed[taker, triangles])

    def part(self, area_m2: float, tolerance_m2: float) -> Mask:
        """The part of about this area to give, shape (m,); it is connected to the taker, and the rest to itself.

        Nothing is given where no part comes nearer to the area than none.
        """
        ways = self.mesh.graph[self.triangles][:, self.triangles]
        from_taker_m = dijkstra(ways, indices=np.flatnonzero(self.outlets), min_only=True)
        from_taker_m = np.where(self.owned, from_taker_m, -1.0)
        farthest = int(np.argmax(from_taker_m))
        # Nothing given errs by the whole area: a part must come nearer than that.
        best, least_error = np.zeros(len(from_taker_m), dtype=bool), area_m2
        for _ in range(TRIES):
            below, above = self._bracket(farthest, area_m2)
            for given in (below, above):
                error = abs(self._area_m2(given) - area_m2)
                if error < least_error:
                    best, least_error = given, error
            if least_error <= tolerance_m2:
                break
            # The potential is constant in a dead end, which thus changes hands as a whole. It varies in one that
            # holds the farthest triangle.
            farthest = int(np.argmax(np.where(above & ~below, from_taker_m, -2.0)))
        moved = np.zeros(len(self.mesh), dtype=bool)
        moved[self.triangles[best]] = True
        return moved

    def _bracket(self, farthest: int, area_m2: float) -> tuple[Mask, Mask]:
        """The parts below two consecutive levels: one of no more than the area, the other of more."""
        order = np.argsort(self._potential(farthest), kind="stable")
        # Stable, since ties are common, and the order decides which triangles change hands. The farthest one never
        # does: it comes last.
        low, high = 0, len(order) - 1
        below, above = self._severed(order[:low], farthest), self._severed(order[:high], farthest)
        while high - low > 1:
            middle = (low + high) // 2
            given = self._severed(order[:middle], farthest)
            if self._area_m2(given) <= area_m2:
                low, below = middle, given
            else:
                high, above = middle, given
        return below, above

    def _area_m2(self, given: Mask) -> float:
        """The area of what is given; infinite if the taker must not have some of it."""
        return math.inf if (given & self.barred).any() else float(self.mesh.areas_m2[self.triangles[given]].sum())

    def _potential(self, farthest: int) -> FloatArray:
        """The harmonic potential: 0 beyond the outlets, 1 in the farthest triangle and where it is barred."""
        laplacian = diags_array(self.conductances.sum(axis=1) + self.outlets) - self.conductances
        fixed = self.barred.copy()
        fixed[farthest] = True
        free = np.flatnonzero(~fixed)
        potential = np.ones(len(self.triangles))
        inflow: FloatArray = np.asarray(self.conductances[free][:, fixed].sum(axis=1))
        potential[free] = spsolve(laplacian.tocsc()[free][:, free], inflow)
        return potential

    def _severed(self, part: Indices, farthest: int) -> Mask:
        """The part, less what would not be connected to the taker, plus what it cuts off from `farthest`."""
        given = np.zeros(len(self.triangles), dtype=bool)
        given[part] = True
        given &= np.isin(pieces := self._pieces(given), pieces[given & (self.outlets > 0)])
        left = self._pieces(~given)
        return np.asarray(left != left[farthest])

    def _pieces(self, which: Mask) -> Indices:
        """The number of the connected piece of each triangle, among those of its kind."""
        graph = self.conductances.tocoo()
        alike = which[graph.row] == which[graph.col]
        alike_graph = csr_array((graph.data[alike], (graph.row[alike], graph.col[alike])), shape=graph.shape)
        return np.asarray(connected_components(alike_graph, directed=False)[1])
