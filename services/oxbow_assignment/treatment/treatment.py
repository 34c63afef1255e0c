"""Treating one hot spot: its passes in order, joined to one line inside the free space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from scipy.spatial import KDTree
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray, Indices
from oxbow.contracts import HotSpot
from oxbow.errors import InvalidRequest
from oxbow.geometry.route import Router
from oxbow_assignment.targets.ordering import improved_path
from oxbow_assignment.treatment.lines import chained_line
from oxbow_assignment.treatment.passes import chord, parallel_passes, passes_needed

__all__ = ["COVERED", "Treatment", "treatment_of"]

COVERED = 0.995
"""The fraction of a hot spot's water that its passes are to treat."""

ROUNDS = 8
"""How often passes are added for what was missed; three suffice for all but the most ragged shapes."""

MOST_PASSES = 1_000
"""More passes than this over one hot spot point to a mistake in `swath_m`."""

NEAR = 8
"""From each end of a pass, sight is checked to this many nearest ends of passes."""

BLOCKED = 3.0
"""An end that land hides counts this many times its straight distance."""

APART = 4.0
"""A way between passes costs this many times the greatest distance more, so that no pass is left half-way."""


@dataclass(frozen=True)
class Treatment:
    """How a hot spot is treated.

    Parameters
    ----------
    spot
        The hot spot.
    water
        Its part in the free space.
    passes
        In order, the way they are travelled.
    line
        The passes and the ways between them, inside the free space; may be travelled from either end.
    """

    spot: HotSpot
    water: BaseGeometry
    passes: tuple[LineString, ...]
    line: LineString


def treatment_of(spot: HotSpot, water: BaseGeometry, free: Polygon, router: Router, swath_m: float) -> Treatment:
    """Cover a hot spot with parallel passes, and with further ones what these miss at slanted shores and islands.

    Parameters
    ----------
    spot, water
        The hot spot and its part in the free space, not empty.
    free
        Where passes and ways between them run; prepared.
    router
        Finds ways between passes with land between them.
    swath_m
        The width that one pass treats.

    Returns
    -------
    Treatment
        Its passes treat `COVERED` of the water, or as much as `ROUNDS` of further ones could.

    Raises
    ------
    InvalidRequest
        The swath is so small that the hot spot would take thousands of passes.
    """
    # Before the passes are made: a tiny swath would make millions of them.
    _require_few(passes_needed(water, swath_m), spot, swath_m)
    # In a hot spot of thin pieces the middle of every band may be land: then each piece gets passes of its own.
    more = parallel_passes(water, free, swath_m) or _further_passes(Polygon(), water, free, swath_m)
    _require_few(len(more), spot, swath_m)
    passes: list[LineString] = []
    for _ in range(ROUNDS):
        passes = ordered_passes([*passes, *more], free)
        line = linked_passes(passes, free, router)
        more = _further_passes(line.buffer(swath_m / 2), water, free, swath_m)
        if not more:
            break
    return Treatment(spot, water, tuple(passes), line)


def _require_few(passes: int, spot: HotSpot, swath_m: float) -> None:
    if passes > MOST_PASSES:
        raise InvalidRequest(
            f"is {swath_m:g} m: hot spot {spot.name!r} would take {passes} passes; expected"
            f" {swath_m * passes / MOST_PASSES:.3g} m or more",
            where="swath_m",
        )


def _further_passes(treated: BaseGeometry, water: BaseGeometry, free: Polygon, swath_m: float) -> list[LineString]:
    """Passes over what is not treated, the largest pieces first, until little enough would be left."""
    missed = shapely.get_parts(shapely.difference(water, treated))
    missed = missed[np.argsort(-shapely.area(missed), kind="stable")]
    areas = shapely.area(missed)
    # `left[k]` is what would still be missed if only the k largest pieces were treated.
    left = np.cumsum(areas[::-1])[::-1]
    pieces = missed[left > (1.0 - COVERED) * water.area].tolist()
    return [line for piece in pieces for line in chord(piece, free, swath_m)]


def ordered_passes(passes: Sequence[LineString], free: Polygon) -> list[LineString]:
    """The passes in an order, and each in a direction, that makes the ways between them short.

    The order goes from each pass to the nearest next one, which runs back and forth over parallel passes; then
    2-opt and Or-opt improve it. Ways are measured straight, and count more over land.

    Parameters
    ----------
    passes
        In any order and direction.
    free
        The free space; prepared.

    Returns
    -------
    list of LineString
        The same lines, some of them reversed.
    """
    if len(passes) < 2:
        return list(passes)
    ends = np.array([line.coords[end] for line in passes for end in (0, -1)])
    apart = _distances(ends, free)
    # Both ends of a pass stay neighbours all along, so that every other row is where a pass begins.
    rows = improved_path(*_as_path(apart, _nearest_next(apart)))[1:-1]
    return [_directed(passes[row // 2], backwards=bool(row % 2)) for row in rows[::2].tolist()]


def linked_passes(passes: Sequence[LineString], free: Polygon, router: Router) -> LineString:
    """One line along all passes, straight from one to the next where that stays inside, or else along a route.

    Parameters
    ----------
    passes
        At least one, in order and direction.
    free
        The free space; prepared.
    router
        Finds ways between passes with land between them.

    Returns
    -------
    LineString
        Inside `free` if the passes are.
    """
    parts = [passes[0]]
    for before, after in pairwise(passes):
        # Most ways between neighbouring passes are straight: only the others are worth a search.
        way = LineString([before.coords[-1], after.coords[0]])
        if not free.covers(way):
            parts.append(router.route(*way.coords).line)
        parts.append(after)
    return chained_line(parts)


def _distances(ends: FloatArray, free: Polygon) -> FloatArray:
    """Distances between ends of passes, in metres, shape (2 n, 2 n); near ones that land hides count more."""
    apart = np.hypot(*(ends[:, None] - ends[None]).transpose(2, 0, 1))
    near = KDTree(ends).query(ends, k=min(NEAR + 1, len(ends)))[1]
    here = np.repeat(np.arange(len(ends)), near.shape[1])
    there = near.ravel()
    # Near ends only: far ones are hardly ever next to each other in an order.
    sights = shapely.linestrings(np.stack([ends[here], ends[there]], axis=1))
    hidden = ~shapely.covers(free, sights) & (here != there)
    factor = np.ones_like(apart)
    factor[here[hidden], there[hidden]] = factor[there[hidden], here[hidden]] = BLOCKED
    return np.asarray(apart * factor)


def _nearest_next(apart: FloatArray) -> list[int]:
    """Rows of both ends of all passes: from the first pass on, always to the nearest end of another."""
    left = np.ones(len(apart), dtype=bool)
    rows = [0, 1]
    left[:2] = False
    while left.any():
        start = int(np.where(left, apart[rows[-1]], np.inf).argmin())
        rows += [start, start ^ 1]  # `^ 1` is the other end of the same pass
        left[[start, start ^ 1]] = False
    return rows


def _as_path(apart: FloatArray, rows: list[int]) -> tuple[FloatArray, Indices]:
    """Distances and a path for `improved_path`, whose first and last row stand for nowhere.

    Both ends of a pass are 0 m apart, and all others so far that passes stay whole.
    """
    count = len(apart)
    distances = np.zeros((count + 2, count + 2))
    distances[:count, :count] = apart + APART * apart.max()
    even = np.arange(0, count, 2)
    distances[even, even + 1] = distances[even + 1, even] = 0.0
    np.fill_diagonal(distances, 0.0)
    return distances, np.array([count, *rows, count + 1])


def _directed(line: LineString, *, backwards: bool) -> LineString:
    return line.reverse() if backwards else line
