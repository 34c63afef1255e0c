"""Transects: where the sweep lines cross the cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from oxbow.arrays import FloatArray
from oxbow.contracts import Cell

__all__ = ["Transect", "place_transects"]


@dataclass(frozen=True)
class Transect:
    """One sweep line within one cell, in the sweep frame: from (u, low) to (u, high), shore to shore."""

    cell: int
    u: float
    low: float
    high: float

    @property
    def length_m(self) -> float:
        """From shore to shore."""
        return self.high - self.low


def sweep_lines(cells: Sequence[Cell], pitch_m: float, phase: float) -> FloatArray:
    """Abscissae u of the sweep lines over all cells, shape (n,), in rising order.

    Parameters
    ----------
    cells
        The decomposition's cells, in the sweep frame; at least one.
    pitch_m
        Distance between neighbouring sweep lines.
    phase
        Where the first line stands past the least u of the cells, as a fraction of the pitch.

    Returns
    -------
    ndarray, shape (n,)
        In metres, `pitch_m` apart; empty where the water is narrower than the phase.
    """
    start = min(cell.floor[0, 0] for cell in cells)
    end = max(cell.floor[-1, 0] for cell in cells)
    return np.arange(start + phase * pitch_m, end, pitch_m)


def place_transects(
    cells: Sequence[Cell], pitch_m: float, *, phase: float, min_length_m: float
) -> tuple[Transect, ...]:
    """Cut the sweep lines into transects, cell by cell.

    Parameters
    ----------
    cells
        The decomposition's cells, in the sweep frame.
    pitch_m
        Distance between neighbouring sweep lines.
    phase
        Where the first line stands, as a fraction of the pitch.
    min_length_m
        Shorter transects are left out: the site is narrower there than a transect is worth
        (Rendas and Li 2016, section 1.2.1.1, step 6).

    Returns
    -------
    tuple of Transect
        Ordered by cell, then by u.
    """
    lines = sweep_lines(cells, pitch_m, phase)
    transects = []
    for index, cell in enumerate(cells):
        # A line exactly between two cells belongs to the left one, and not to both.
        first, last = np.searchsorted(lines, [cell.floor[0, 0], cell.floor[-1, 0]], side="right")
        us = lines[first:last]
        lows = np.interp(us, cell.floor[:, 0], cell.floor[:, 1])
        highs = np.interp(us, cell.ceiling[:, 0], cell.ceiling[:, 1])
        for u, low, high in zip(us.tolist(), lows.tolist(), highs.tolist(), strict=True):
            if high - low > min_length_m:
                transects.append(Transect(index, u, low, high))
    return tuple(transects)
