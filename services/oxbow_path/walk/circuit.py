"""The circuit over the cells: which transects are joined to which, and where.

The report (Rendas and Li 2016, section 1.2.1.1, step 3) looks for a closed circuit that covers every edge of the
Reeb graph and goes twice through some. Here the circuit is the walk round a *spanning tree*: a walk along both
sides of a tree passes every edge, never crosses itself, and needs no optimal postman tour. Its four decisions
fall out of the walk: a cell is covered on the way along one side of its transects, a lane is left for the way back
on the other side, a cell without transects is crossed directly, and a gate is a jump to the neighbouring cell.

All coordinates are in the sweep frame (u across the transects, v along them).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import networkx as nx
import numpy as np
from shapely import LineString

from oxbow.arrays import FloatArray
from oxbow.contracts import Cell
from oxbow_path.walk.region import Circuit
from oxbow_path.walk.transects import Transect

__all__ = ["plan_circuit"]

Node = tuple[str, int, int]
"""("transect", index, 0), or ("slot", cell, j): the part of a cell between its transects j - 1 and j."""


@dataclass(frozen=True)
class Port:
    """Where a slot of a cell is entered: on a transect (anywhere from low to high) or through a gate."""

    u: float
    low: float
    high: float
    is_gate: bool = True


def plan_circuit(
    cells: Sequence[Cell], transects: Sequence[Transect], *, trim_m: float, inset_m: float
) -> Circuit:
    """Join all transects by the fewest links through the cells.

    Parameters
    ----------
    cells, transects
        The decomposition, and its transects ordered by cell and u; every transect is longer than `2 * trim_m`.
    trim_m
        How far transects stop short of the shore.
    inset_m
        How far from the cell's floor the links run, where there is room: the lane for the way back.

    Returns
    -------
    Circuit
        Links lie strictly inside their cells by construction; together with the transects they are connected.
    """
    tree = _spanning_tree(cells, transects)
    links: list[LineString] = []
    for node in tree.nodes:
        if node[0] == "slot":
            cell = cells[node[1]]
            ports = [_port(node, neighbour, tree, transects, trim_m) for neighbour in tree.neighbors(node)]
            links.extend(_link(cell, near, far, inset_m) for near, far in _pairs(ports))
    links.extend(_joints(tree, links))
    trimmed = (LineString([(t.u, t.low + trim_m), (t.u, t.high - trim_m)]) for t in transects)
    return Circuit(tuple(trimmed), tuple(links))


def _spanning_tree(cells: Sequence[Cell], transects: Sequence[Transect]) -> nx.Graph[Node]:
    """The least tree over transects and slots; slots that lead to no transect are dropped."""
    # Weights are distances in u, between transects and the middles of slots: the tree crosses short slots first.
    graph: nx.Graph[Node] = nx.Graph()
    slots = _slots(cells, transects)
    for index, transect in enumerate(transects):
        graph.add_node(("transect", index, 0), u=transect.u)
    for cell_index, slot_list in enumerate(slots):
        for j, (before, after, width) in enumerate(slot_list):
            for transect_index in (before, after):
                if transect_index is not None:
                    graph.add_edge(("slot", cell_index, j), ("transect", transect_index, 0), weight=width / 2)
    for left, right, low, high in _gates(cells):
        a, b = ("slot", left, len(slots[left]) - 1), ("slot", right, 0)
        weight = (slots[left][-1][2] + slots[right][0][2]) / 2
        graph.add_edge(a, b, weight=weight, port=Port(float(cells[right].floor[0, 0]), low, high))
    # A tree and not a cycle cover: what is walked round has no cycles, which would enclose holes.
    tree = nx.minimum_spanning_tree(graph)
    leaves = [node for node in tree if node[0] == "slot" and tree.degree(node) <= 1]
    while leaves:
        leaf = leaves.pop()
        # Two slots joined to each other alone are both queued at first, and the second again when the first goes.
        if leaf not in tree:
            continue
        neighbours = list(tree.neighbors(leaf))
        tree.remove_node(leaf)
        leaves.extend(n for n in neighbours if n[0] == "slot" and tree.degree(n) <= 1)
    return tree


def _slots(
    cells: Sequence[Cell], transects: Sequence[Transect]
) -> list[list[tuple[int | None, int | None, float]]]:
    """For each cell its slots in order of u: the transect before, the one after, and the slot's width."""
    by_cell: dict[int, list[int]] = {}
    for index, transect in enumerate(transects):
        by_cell.setdefault(transect.cell, []).append(index)
    slots = []
    for index, cell in enumerate(cells):
        own: list[int | None] = [*by_cell.get(index, [])]
        edges = [None, *own, None]
        us = [cell.floor[0, 0], *(transects[i].u for i in by_cell.get(index, [])), cell.floor[-1, 0]]
        slots.append(
            [
                (before, after, float(end - start))
                for (before, after), (start, end) in zip(
                    itertools.pairwise(edges), itertools.pairwise(us), strict=True
                )
            ]
        )
    return slots


def _gates(cells: Sequence[Cell]) -> Iterator[tuple[int, int, float, float]]:
    """Where one cell ends and another begins along a common stretch: (left, right, low, high)."""
    starting: dict[int, list[int]] = {}
    for index, cell in enumerate(cells):
        starting.setdefault(cell.start, []).append(index)
    for left, cell in enumerate(cells):
        for right in starting.get(cell.end, []):
            low = max(cell.floor[-1, 1], cells[right].floor[0, 1])
            high = min(cell.ceiling[-1, 1], cells[right].ceiling[0, 1])
            if high > low:
                yield left, right, float(low), float(high)


def _port(slot: Node, neighbour: Node, tree: nx.Graph[Node], transects: Sequence[Transect], trim_m: float) -> Port:
    if neighbour[0] == "transect":
        transect = transects[neighbour[1]]
        return Port(transect.u, transect.low + trim_m, transect.high - trim_m, is_gate=False)
    port: Port = tree.edges[slot, neighbour]["port"]
    return port


def _pairs(ports: Sequence[Port]) -> Iterator[tuple[Port, Port]]:
    """Which ports of a slot to join: every gate to a transect, or the gates one above the other."""
    ordered = sorted(ports, key=lambda port: (port.is_gate, port.low, port.u))
    if ordered[0].is_gate:
        return itertools.pairwise(ordered)
    return ((ordered[0], port) for port in ordered[1:])


def _link(cell: Cell, near: Port, far: Port, inset_m: float) -> LineString:
    """Join two ports of a cell: straight and along the floor where that stays inside, else between the shores."""
    if near.u == far.u:
        return _detour(cell, near, far, inset_m)
    _, floor, ceiling = _profile(cell, near.u, far.u)
    # A level line is one straight leg, where the cell has a common height all the way.
    low = max(float(floor.max()), near.low, far.low)
    high = min(float(ceiling.min()), near.high, far.high)
    if high > low:
        v = low + min(inset_m, (high - low) / 2)
        return LineString([(near.u, v), (far.u, v)])
    starts = [port.low + min(inset_m, (port.high - port.low) / 2) for port in (near, far)]
    return LineString(_crossing(cell, (near.u, starts[0]), (far.u, starts[1])))


def _joints(tree: nx.Graph[Node], links: Sequence[LineString]) -> Iterator[LineString]:
    """Along each gate, the stretch between the links that pass it at different places."""
    ends = np.asarray([link.coords[i] for link in links for i in (0, -1)]).reshape(-1, 2)
    gates: list[Port] = [edge["port"] for *_, edge in tree.edges(data=True) if "port" in edge]
    for gate in gates:
        on_gate = (ends[:, 0] == gate.u) & (ends[:, 1] >= gate.low) & (ends[:, 1] <= gate.high)
        low, high = ends[on_gate, 1].min(), ends[on_gate, 1].max()
        if high > low:
            yield LineString([(gate.u, low), (gate.u, high)])


def _detour(cell: Cell, below: Port, above: Port, inset_m: float) -> LineString:
    """Join two gates on one side of a cell: into it, and back round the critical point between them."""
    start, end = float(cell.floor[0, 0]), float(cell.floor[-1, 0])
    depth_m = min(inset_m, (end - start) / 2)
    turn_u = below.u + depth_m if below.u <= (start + end) / 2 else below.u - depth_m
    turn = (turn_u, _between(cell, turn_u))
    leave = below.high - min(inset_m, (below.high - below.low) / 2)
    enter = above.low + min(inset_m, (above.high - above.low) / 2)
    there = _crossing(cell, (below.u, leave), turn)
    back = _crossing(cell, turn, (above.u, enter))
    return LineString(np.vstack([there, back]))


def _between(cell: Cell, u: float) -> float:
    low = np.interp(u, cell.floor[:, 0], cell.floor[:, 1])
    high = np.interp(u, cell.ceiling[:, 0], cell.ceiling[:, 1])
    return float(low + high) / 2


def _profile(cell: Cell, near_u: float, far_u: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The abscissae of all vertices between two abscissae, with the floor's and the ceiling's v there."""
    us = np.concatenate([cell.floor[:, 0], cell.ceiling[:, 0]])
    low, high = min(near_u, far_u), max(near_u, far_u)
    us = np.unique(np.concatenate([us[(us > low) & (us < high)], [low, high]]))
    floor = np.interp(us, cell.floor[:, 0], cell.floor[:, 1])
    ceiling = np.interp(us, cell.ceiling[:, 0], cell.ceiling[:, 1])
    return us, floor, ceiling


def _crossing(cell: Cell, start: tuple[float, float], end: tuple[float, float]) -> FloatArray:
    """A curve from `start` to `end` whose relative height between floor and ceiling changes evenly.

    Between two vertices floor, ceiling and curve are straight, and at every vertex the curve is strictly between
    the other two: it cannot leave the cell.
    """
    if start[0] == end[0]:
        return np.array([start, end])
    us, floor, ceiling = _profile(cell, start[0], end[0])
    (u0, v0), (u1, v1) = sorted([start, end])
    # A cell has no height at a critical point where its chains meet.
    height = np.maximum(ceiling - floor, 1e-12)
    first, last = (v0 - floor[0]) / height[0], (v1 - floor[-1]) / height[-1]
    share = np.clip(np.interp(us, [u0, u1], [first, last]), 0.0, 1.0)
    vs = floor + share * (ceiling - floor)
    # Links have to meet transects and other links exactly, or the circuit falls apart.
    vs[0], vs[-1] = v0, v1
    curve = np.column_stack([us, vs])
    return curve if start[0] <= end[0] else curve[::-1]
