"""Places drawn evenly over the cells of the decomposition: the inputs of the Kohonen ring."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from oxbow.arrays import FloatArray
from oxbow.contracts import Cell, Draw
from oxbow_path.halton import scrambled_halton

__all__ = ["cell_draws", "drawn_places"]


def drawn_places(cells: Sequence[Cell], count: int, *, seed: int, draw: Draw) -> FloatArray:
    """Places over all cells, shape (count, 2), each cell's share being that of its area.

    As in Rendas and Li 2016, section 1.2.1.4, every cell has a low-discrepancy sequence of its own. There it fills
    the rectangle about the cell, and what falls outside is lost; here the unit square is carried onto the cell so
    that equal areas stay equal. There two of its points are combined at random, on the grounds that a cell holds
    what lies between two of its points; cells need not be convex, so here the points are combined in the unit
    square, whose image always lies inside. That draw favours the cells' middles, and is not the default.

    Parameters
    ----------
    cells
        The decomposition's cells, in the sweep frame.
    count
        How many places, positive; rounding the cells' shares keeps to it.
    seed
        Of the sequences' scrambling, and of the combinations.
    draw
        The sequence itself, or combinations of two of its points.

    Returns
    -------
    ndarray, shape (count, 2)
        Places (u, v) in the sweep frame, cell by cell.

    Raises
    ------
    ValueError
        `count` is not positive.
    """
    if count <= 0:
        raise ValueError(f"count is {count}; expected a number > 0")
    areas = np.array([_Profile(cell).area_m2 for cell in cells])
    # The ends of the cells' shares are rounded, not the shares: these then add up to `count`.
    ends = np.rint(np.cumsum(areas) / areas.sum() * count).astype(int)
    shares = np.diff(ends, prepend=0)
    generator = np.random.default_rng(seed)
    squares = [_unit_square(int(share), generator, draw) for share in shares]
    return np.vstack([cell_draws(cell, square) for cell, square in zip(cells, squares, strict=True)])


def _unit_square(count: int, generator: np.random.Generator, draw: Draw) -> FloatArray:
    sequence = scrambled_halton(count, generator)
    if draw is Draw.LOW_DISCREPANCY or count == 0:
        return sequence
    first, second = generator.integers(count, size=(2, count))
    share = generator.random((count, 1))
    return np.asarray(share * sequence[first] + (1.0 - share) * sequence[second])


def cell_draws(cell: Cell, square: FloatArray) -> FloatArray:
    """Carry points (n, 2) of the unit square onto a cell, equal areas onto equal areas.

    Unlike `oxbow.geometry.triangles.spread`, it is continuous: what is even in the square is even across the whole
    cell. The first coordinate chooses the abscissa that has this share of the cell's area to its left, the second
    the height between floor and ceiling.

    Parameters
    ----------
    cell
        In the sweep frame.
    square
        Shape (n, 2), each coordinate in [0, 1].

    Returns
    -------
    ndarray, shape (n, 2)
        Places (u, v) in the cell, in the order of the points.
    """
    profile = _Profile(cell)
    u = profile.abscissa(square[:, 0] * profile.area_m2)
    floor = np.interp(u, cell.floor[:, 0], cell.floor[:, 1])
    ceiling = np.interp(u, cell.ceiling[:, 0], cell.ceiling[:, 1])
    return np.column_stack([u, floor + square[:, 1] * (ceiling - floor)])


class _Profile:
    """A cell's width as a function of u: linear between breaks, with jumps where the shore is upright."""

    def __init__(self, cell: Cell) -> None:
        self.breaks = np.unique(np.concatenate([cell.floor[:, 0], cell.ceiling[:, 0]]))
        self.spans = np.diff(self.breaks)
        # The width may jump at a break. Linear extrapolation from two inner points gives its limit from each side.
        inner = [
            np.interp(u, cell.ceiling[:, 0], cell.ceiling[:, 1]) - np.interp(u, cell.floor[:, 0], cell.floor[:, 1])
            for u in (self.breaks[:-1] + self.spans / 4, self.breaks[:-1] + self.spans * 3 / 4)
        ]
        self.first = np.maximum(1.5 * inner[0] - 0.5 * inner[1], 0.0)
        self.last = np.maximum(1.5 * inner[1] - 0.5 * inner[0], 0.0)
        self.ends_m2 = np.cumsum(self.spans * (self.first + self.last) / 2)

    @property
    def area_m2(self) -> float:
        return float(self.ends_m2[-1]) if len(self.ends_m2) else 0.0

    def abscissa(self, area_m2: FloatArray) -> FloatArray:
        """The u that have the given areas of the cell to their left."""
        span = np.minimum(np.searchsorted(self.ends_m2, area_m2), len(self.spans) - 1)
        first, last, length = self.first[span], self.last[span], self.spans[span]
        rest = (area_m2 - (self.ends_m2[span] - length * (first + last) / 2)) / length
        # The area within a span is quadratic in the share; this form of its root holds for even widths too.
        root = np.sqrt(np.maximum(first**2 + 2 * (last - first) * rest, 0.0))
        share = 2 * rest / np.maximum(first + root, np.finfo(float).tiny)
        return np.asarray(self.breaks[span] + np.clip(share, 0.0, 1.0) * length)
