"""Cells between critical points: the boustrophedon decomposition of a polygon."""

from __future__ import annotations

from bisect import bisect
from dataclasses import dataclass, field

import numpy as np
from shapely import Polygon

from oxbow.contracts import Cell, CriticalKind, CriticalPoint, Decomposition, HeadingScore
from oxbow.geometry.sweep import from_sweep
from oxbow_decomposition.boundary import boundary_walks
from oxbow_decomposition.chains import Chain, Extreme, Mark, extremes

__all__ = ["decompose"]


def decompose(free: Polygon, heading_rad: float, scores: tuple[HeadingScore, ...] = ()) -> Decomposition:
    """Cut a polygon into cells that every transect line meets in one interval.

    The boustrophedon decomposition of Choset 2000, with the critical points and Reeb graph of Rendas and Li
    2016, section 1.2.1.1, step 2. It departs from both in that the sweep line stops at critical points alone
    (the chains between them are arrays that a binary search enters), and in that a shared abscissa is no
    special case (`oxbow_decomposition.chains`). With n vertices and m critical points it takes O(m log m) binary
    searches, and time to copy the n vertices into the cells.

    Parameters
    ----------
    free
        A valid polygon in planar metres; holes may touch one another and the border in single points.
    heading_rad
        Direction of the transects, clockwise from north.
    scores
        What the choice of the heading rests on, if it was one.

    Returns
    -------
    Decomposition
        Cells in the order in which they end. They tile the polygon. Those between critical points of equal u
        have no width; they keep the Reeb graph connected where the water is.
    """
    met = extremes(boundary_walks(free), heading_rad)
    sweep = _Sweep()
    kinds = [sweep.meet(extreme) for extreme in met]
    places = from_sweep([(extreme.place.u, extreme.place.v) for extreme in met], heading_rad).tolist()
    return Decomposition(
        heading_rad=heading_rad,
        cells=tuple(sweep.cells),
        critical_points=tuple(
            CriticalPoint(kind=kind, place=(x, y)) for kind, (x, y) in zip(kinds, places, strict=True)
        ),
        scores=scores,
    )


@dataclass(slots=True, eq=False)
class _Open:
    """A cell that the sweep line is in: its chains, where they enter it, and the critical point it starts at."""

    floor: Chain
    ceiling: Chain
    floor_from: Mark
    ceiling_from: Mark
    start: int

    def middle(self, vertex: Mark) -> float:
        return 0.5 * (self.floor.cut_below(vertex).v + self.ceiling.cut_above(vertex).v)

    def margin(self, vertex: Mark) -> float:
        """How far inside the cell a vertex is, along the sweep line; negative outside."""
        return min(vertex.v - self.floor.cut_below(vertex).v, self.ceiling.cut_above(vertex).v - vertex.v)


@dataclass(slots=True)
class _Sweep:
    """The sweep line: the open cells on it from the lowest upwards, and all that it has passed."""

    line: list[_Open] = field(default_factory=list)
    above: dict[Chain, _Open] = field(default_factory=dict)
    below: dict[Chain, _Open] = field(default_factory=dict)
    cells: list[Cell] = field(default_factory=list)
    met: int = 0

    def meet(self, extreme: Extreme) -> CriticalKind:
        """Go on to the next critical point; returns its kind."""
        if extreme.minimum:
            kind = self._open(extreme) if extreme.opens else self._split(extreme)
        # One cell between the two chains closes; two cells, one above and one below, merge.
        elif self.above[extreme.floor] is self.below[extreme.ceiling]:
            kind = self._close(extreme)
        else:
            kind = self._merge(extreme)
        self.met += 1
        return kind

    def _open(self, at: Extreme) -> CriticalKind:
        self._begin(self._position(at.place), at.floor, at.floor.first, at.ceiling, at.ceiling.first)
        return CriticalKind.OPEN

    def _split(self, at: Extreme) -> CriticalKind:
        position = self._position(at.place)
        # Between the middles of two cells, the vertex lies in the upper half of one or the lower half of the next.
        cell = max(self.line[max(position - 1, 0) : position + 1], key=lambda cell: cell.margin(at.place))
        floor_at, ceiling_at = cell.floor.cut_below(at.place), cell.ceiling.cut_above(at.place)
        position = self._end(cell, floor_at, ceiling_at)
        self._begin(position, cell.floor, floor_at, at.ceiling, at.ceiling.first)
        self._begin(position + 1, at.floor, at.floor.first, cell.ceiling, ceiling_at)
        return CriticalKind.SPLIT

    def _close(self, at: Extreme) -> CriticalKind:
        self._end(self.above[at.floor], at.floor.last, at.ceiling.last)
        return CriticalKind.CLOSE

    def _merge(self, at: Extreme) -> CriticalKind:
        lower, upper = self.below[at.ceiling], self.above[at.floor]
        floor_at, ceiling_at = lower.floor.cut_below(at.place), upper.ceiling.cut_above(at.place)
        # The upper one first: its removal does not change the position of the lower.
        self._end(upper, at.floor.last, ceiling_at)
        position = self._end(lower, floor_at, at.ceiling.last)
        self._begin(position, lower.floor, floor_at, upper.ceiling, ceiling_at)
        return CriticalKind.MERGE

    def _position(self, vertex: Mark) -> int:
        """How many open cells have their middle below a vertex (or level with it)."""
        # By middles, which are in order even where rounded cuts of neighbours touch.
        return bisect(self.line, vertex.v, key=lambda cell: cell.middle(vertex))

    def _begin(self, position: int, floor: Chain, floor_at: Mark, ceiling: Chain, ceiling_at: Mark) -> None:
        cell = _Open(floor, ceiling, floor_at, ceiling_at, start=self.met)
        self.line.insert(position, cell)
        self.above[floor] = self.below[ceiling] = cell

    def _end(self, cell: _Open, floor_at: Mark, ceiling_at: Mark) -> int:
        """Take a cell off the line; returns its position there."""
        floor = cell.floor.between(cell.floor_from, floor_at)
        ceiling = cell.ceiling.between(cell.ceiling_from, ceiling_at)
        # An upright shore at the very start of a floor or end of a ceiling faces the neighbour's water.
        floor = floor[np.searchsorted(floor[:, 0], floor[0, 0], side="right") - 1 :]
        ceiling = ceiling[: np.searchsorted(ceiling[:, 0], ceiling[-1, 0]) + 1]
        # Where the two chains meet, rounded cuts must not cross.
        ceiling[[0, -1], 1] = np.maximum(ceiling[[0, -1], 1], floor[[0, -1], 1])
        self.cells.append(Cell(floor=floor, ceiling=ceiling, start=cell.start, end=self.met))
        position = self.line.index(cell)
        del self.line[position]
        return position
