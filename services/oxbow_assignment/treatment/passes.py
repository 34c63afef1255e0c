"""Parallel passes over a region, swath beside swath, in as few metres as possible."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import shapely
from shapely import LineString, MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray, Indices

__all__ = ["chord", "parallel_passes", "passes_needed"]

HEADINGS = 4
"""How many headings are tried: those across which the region is narrowest."""

SWATH_SLACK = 1e-6
"""Fraction of a swath by which a region may be wider without a further pass, so that rounding makes none."""

NEGLIGIBLE = 1e-3
"""Fraction of the region's area that its smallest pieces may make up without a pass of their own."""

ENOUGH = 0.9
"""A straight pass that treats this fraction of a missed piece is good enough for it."""


def parallel_passes(region: BaseGeometry, free: Polygon, swath_m: float) -> list[LineString]:
    """Passes at most `swath_m` apart, along the heading that needs least length.

    Treatment missions are planned with the geometric planners of mapping missions (Rendas and Li 2016,
    introduction), in this case parallel transects. They are fewest along an edge of the convex hull across which
    the region is narrow (W. H. Huang, 2001). The outermost run half a spacing inside the region's rim, and each
    reaches from one end to the other of the region's part in its band.

    Parameters
    ----------
    region
        What is to be treated, inside the free space; one polygon or several.
    free
        Where passes may run; land interrupts a pass.
    swath_m
        The width that one pass treats.

    Returns
    -------
    list of LineString
        Inside `free`; empty where land is in the middle of every band.
    """
    region = _essential(region)
    # The narrowest width has the fewest bands, but not always the fewest metres: a few of the best are laid out.
    candidates = [_stripes(region, free, swath_m, heading) for heading in _headings(region)]
    return min(candidates, key=lambda passes: _length_m(passes, swath_m))


def passes_needed(region: BaseGeometry, swath_m: float) -> int:
    """The least number of parallel swaths that span the region, at the best heading.

    Parameters
    ----------
    region
        What is to be treated; of positive area.
    swath_m
        The width that one pass treats.

    Returns
    -------
    int
        At least 1.
    """
    return max(1, math.ceil(float(_widths_m(region.convex_hull)[1].min()) / swath_m))


def chord(piece: Polygon, free: Polygon, swath_m: float) -> list[LineString]:
    """Passes over a thin piece that parallel passes missed: straight along its middle, or else along its rim.

    Parameters
    ----------
    piece
        What was missed, inside the free space.
    free
        Where passes may run.
    swath_m
        The width that one pass treats.

    Returns
    -------
    list of LineString
        Several if land interrupts the pass.
    """
    box = shapely.get_coordinates(piece.minimum_rotated_rectangle)
    if len(box) >= 5:  # else the piece is so thin that its rectangle is a line
        sides = np.hypot(*np.diff(box[:3], axis=0).T)
        ends = (box[[0, 1]] + box[[3, 2]]) / 2 if sides[0] > sides[1] else (box[[0, 3]] + box[[1, 2]]) / 2
        straight = _lines(shapely.intersection(LineString(ends), free))
        treated = shapely.union_all(shapely.buffer(straight, swath_m / 2)).intersection(piece)
        if treated.area >= ENOUGH * piece.area:
            return straight
    return [LineString(piece.exterior)]


def _essential(region: BaseGeometry) -> BaseGeometry:
    """The region without specks that are a negligible part of it."""
    parts = shapely.get_parts(region)
    areas = shapely.area(parts)
    order = np.argsort(areas, kind="stable")
    kept = order[np.cumsum(areas[order]) > NEGLIGIBLE * areas.sum()]
    return MultiPolygon(parts[np.sort(kept)].tolist())


def _widths_m(hull: BaseGeometry) -> tuple[FloatArray, FloatArray]:
    """The direction of each edge of a convex polygon, in radians from the x axis, and the width across it."""
    ring = shapely.get_coordinates(hull)
    edges = np.diff(ring, axis=0)
    edges = edges[np.hypot(*edges.T) > 0.0]
    across = np.column_stack([-edges[:, 1], edges[:, 0]]) / np.hypot(*edges.T)[:, None]
    along = (ring - ring[0]) @ across.T
    return np.arctan2(edges[:, 1], edges[:, 0]), np.ptp(along, axis=0)


def _headings(region: BaseGeometry) -> FloatArray:
    headings, widths = _widths_m(region.convex_hull)
    return headings[np.argsort(widths, kind="stable")[:HEADINGS]]


def _stripes(region: BaseGeometry, free: Polygon, swath_m: float, heading: float) -> list[LineString]:
    """One pass along the middle of each band, wherever the region has area in it."""
    turn = np.array([[math.cos(heading), -math.sin(heading)], [math.sin(heading), math.cos(heading)]])
    x0, y0, x1, y1 = _bounds(region, turn)
    count = max(1, math.ceil((y1 - y0) / swath_m - SWATH_SLACK))
    floors = y0 + (y1 - y0) / count * np.arange(count)
    ones = np.ones(count)
    # A metre longer than the region: rounding must not cut its ends off.
    bands = shapely.box((x0 - 1.0) * ones, floors, (x1 + 1.0) * ones, floors + (y1 - y0) / count)
    # The bands are turned, not the region: rings of it that touch would make an invalid polygon after rounding.
    bands = shapely.transform(bands, lambda xy: xy @ turn.T)
    pieces, band = shapely.get_parts(shapely.intersection(region, bands), return_index=True)
    flat = shapely.area(pieces) == 0.0
    low, high = np.array([_bounds(piece, turn)[[0, 2]] for piece in pieces[~flat]]).T
    ends = np.array(list(_merged(band[~flat], low, high)))
    middles = floors[ends[:, 0].astype(int)] + (y1 - y0) / count / 2
    places = np.stack([np.column_stack([ends[:, k], middles]) for k in (1, 2)], axis=1) @ turn.T
    lines = np.asarray(shapely.linestrings(places))
    clear = shapely.covers(free, lines)
    lines[~clear] = shapely.intersection(lines[~clear], free)
    return [part for line in lines for part in _lines(line)]


def _bounds(geometry: BaseGeometry, turn: FloatArray) -> FloatArray:
    """Least x and y and greatest x and y of a geometry in a turned frame."""
    points = shapely.get_coordinates(geometry) @ turn
    return np.concatenate([points.min(axis=0), points.max(axis=0)])


def _merged(band: Indices, low: FloatArray, high: FloatArray) -> Iterator[tuple[int, float, float]]:
    """Intervals of one band that overlap, joined: band, low and high end of each."""
    order = np.lexsort([low, band])
    # No interval is open yet.
    at, start, end = -1, 0.0, 0.0
    for number, left, right in zip(band[order].tolist(), low[order].tolist(), high[order].tolist(), strict=True):
        if number == at and left <= end:
            end = max(end, right)
            continue
        if at >= 0:
            yield at, start, end
        at, start, end = number, left, right
    yield at, start, end


def _lines(geometry: BaseGeometry) -> list[LineString]:
    """The lines of a geometry, without its points."""
    parts = shapely.get_parts(geometry)
    return [part for part in parts.tolist() if part.geom_type == "LineString" and part.length > 0.0]


def _length_m(passes: list[LineString], swath_m: float) -> float:
    """Metres of passes and, approximately, of the ways between them."""
    return sum(line.length for line in passes) + swath_m * (len(passes) - 1)
