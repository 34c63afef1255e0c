"""Lattices of places in an area. Cost grows with the places and the shore, not with the bounding box."""

from __future__ import annotations

import math

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray, Indices, Place

__all__ = ["RINGS", "joined_lattice", "lattice_within", "triangular_lattice"]

ROW = math.sqrt(0.75)
"""How far apart the rows of a lattice of equilateral triangles are, in sides of these."""

RINGS = (
    ((1, 0), (0, 1), (-1, 1)),
    ((1, 1), (-1, 2), (-2, 1)),
    ((2, 1), (1, 2), (-1, 3), (-2, 3), (-3, 2), (-3, 1)),
)
"""Half of the neighbours at distances 1, sqrt(3) and sqrt(7), in steps along the row and to the row above (leaning
right); the other half are their opposites."""


def lattice_within(
    area: BaseGeometry, origin: Place, pitch_m: float, row_m: float, *, shift_m: float = 0.0
) -> FloatArray:
    """The places of a lattice that lie in an area.

    Row k of the lattice is the line y = origin_y + k row_m. The shore crosses it at places between which the line
    is alternately inside and outside the area (the scan lines of Wylie et al. 1967): only places inside are made.

    Parameters
    ----------
    area
        Valid polygons, in metres.
    origin
        A place of the lattice, on an even row.
    pitch_m, row_m
        Distances between neighbours in a row, and between rows; positive.
    shift_m
        How far odd rows are moved on.

    Returns
    -------
    ndarray, shape (n, 2)
        In metres, row by row.
    """
    row, x = _crossings(area, origin[1], row_m)
    # Crossings of a row come in pairs, entry and exit, because there is an even number of them in each.
    row, low, high = row[::2], x[::2], x[1::2]
    start = origin[0] + shift_m * (row % 2)
    first = np.ceil((low - start) / pitch_m).astype(np.int64)
    chord, number = _counted(np.floor((high - start) / pitch_m).astype(np.int64) - first + 1)
    return np.column_stack(
        [start[chord] + (first[chord] + number) * pitch_m, origin[1] + row[chord] * row_m],
    )


def triangular_lattice(area: BaseGeometry, origin: Place, side_m: float) -> FloatArray:
    """The places of a lattice of equilateral triangles that lie in an area, shape (n, 2), row by row.

    Parameters
    ----------
    area
        Valid polygons, in metres.
    origin
        A place of the lattice; odd rows from there are moved on by half a side.
    side_m
        Length of the triangles' sides, which run along x.

    Returns
    -------
    ndarray, shape (n, 2)
        In metres, row by row from the lowest; empty where no place falls into the area.
    """
    return lattice_within(area, origin, side_m, side_m * ROW, shift_m=side_m / 2)


def joined_lattice(
    low: FloatArray, high: FloatArray, side_m: float, rings: tuple[tuple[tuple[int, int], ...], ...] = RINGS
) -> tuple[FloatArray, Indices]:
    """A lattice of equilateral triangles over a rectangle, and the pairs of neighbours on some rings.

    Parameters
    ----------
    low, high : ndarray, shape (2,)
        Opposite corners of the rectangle, in metres.
    side_m
        Length of the triangles' sides.
    rings
        Which neighbours are joined.

    Returns
    -------
    places : ndarray, shape (n, 2)
    pairs : ndarray of int, shape (m, 2)
    """
    rows = math.ceil((high[1] - low[1]) / (side_m * ROW)) + 1
    columns = math.ceil((high[0] - low[0]) / side_m) + 2
    row, column = np.divmod(np.arange(rows * columns), columns)
    places = low + side_m * np.column_stack([column - 0.5 * (row % 2), row * ROW])
    pairs = []
    for along, up in (step for ring in rings for step in ring):
        # Odd rows lie half a side to the left.
        above = row + up
        beside = column + along + (above % 2 - row % 2 + up) // 2
        inside = (above < rows) & (beside >= 0) & (beside < columns)
        pairs.append(np.column_stack([np.arange(len(row)), above * columns + beside])[inside])
    return places, np.vstack(pairs)


def _crossings(area: BaseGeometry, first_row_m: float, row_m: float) -> tuple[Indices, FloatArray]:
    """Where the shore crosses each row: the row's number and x, sorted by both; an even number in each row."""
    xy, ring = shapely.get_coordinates(shapely.get_rings(shapely.get_parts(area)), return_index=True)
    rows = (xy[:, 1] - first_row_m) / row_m
    along = ring[1:] == ring[:-1]
    start, end = np.flatnonzero(along), np.flatnonzero(along) + 1
    # A vertex on a row counts as above it, so that its two sides cross the row both, or one, or none.
    low = np.ceil(np.minimum(rows[start], rows[end])).astype(np.int64)
    side, number = _counted(np.ceil(np.maximum(rows[start], rows[end])).astype(np.int64) - low)
    row = low[side] + number
    a, b = start[side], end[side]
    share = (row - rows[a]) / (rows[b] - rows[a])
    x = xy[a, 0] + share * (xy[b, 0] - xy[a, 0])
    # By row, and within a row by x: entries and exits then alternate.
    order = np.lexsort((x, row))
    return row[order], x[order]


def _counted(counts: Indices) -> tuple[Indices, Indices]:
    """Each owner's index, repeated as often as its count (never where negative), and a running number from 0."""
    counts = np.maximum(counts, 0)
    owner = np.repeat(np.arange(len(counts)), counts)
    return owner, np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
