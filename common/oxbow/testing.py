"""Shapes for tests: a catalogue of valid polygons that break careless geometry, degenerate ones included."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import shapely
from shapely import Polygon, affinity, box
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import Place

__all__ = ["nasty_polygons"]


def nasty_polygons() -> dict[str, Polygon]:
    """Valid polygons of about 100 m, by name.

    Equal abscissae, upright and collinear runs, repeated points, slivers, spikes, straits, and rings that touch
    one another in single points: at two vertices, or at a vertex and the middle of an edge.
    """
    return _solid() | _with_islands() | _with_pinches()


def _solid() -> dict[str, Polygon]:
    square = box(0, 0, 100, 100)
    comb = _union([box(0, 0, 100, 10), *(box(x, 0, x + 5, 80) for x in range(0, 100, 10))])
    ragged_comb = Polygon([(0, 0), *_teeth(100.0, 12), (100, 0)])
    return {
        "square": square,
        "diamond": affinity.rotate(square, 45),
        "disc": shapely.Point(50, 50).buffer(50, quad_segs=64),
        "comb": comb,
        "comb on its side": affinity.rotate(comb, 90, origin=(0, 0)),
        "ragged comb": ragged_comb,
        "staircase": _union([box(x, 0, x + 10, x + 10) for x in range(0, 100, 10)]),
        "double staircase": _union([box(x, x, x + 15, x + 15) for x in range(0, 100, 10)]),
        "spiral": _spiral(),
        "collinear runs": shapely.segmentize(square, 0.7),
        "slanted collinear runs": affinity.rotate(shapely.segmentize(square, 0.7), 17),
        "repeated points": Polygon(
            [(0, 0), (0, 0), (100, 0), (100, 50), (100, 50), (100, 50), (0, 50), (0, 0), (0, 0)]
        ),
        "sliver": box(0, 0, 100, 1e-3),
        "slanted sliver": affinity.rotate(box(0, 0, 100, 1e-3), 33),
        "spike of water": Polygon(
            [(0, 0), (100, 0), (100, 40), (300, 40.000001), (100, 41), (100, 100), (0, 100)]
        ),
        "spike of land": Polygon(
            [(0, 0), (50, 0), (50.000001, 99), (50.000002, 0), (100, 0), (100, 100), (0, 100)]
        ),
        "strait": _union([box(0, 0, 40, 100), box(40, 50, 60, 50.000001), box(60, 0, 100, 100)]),
        "far away": affinity.translate(ragged_comb, 1e5, -1e5),
        "cross": _union([box(40, 0, 60, 100), box(0, 40, 100, 60)]),
    }


def _with_islands() -> dict[str, Polygon]:
    square = box(0, 0, 100, 100)
    diamond = Polygon([(50, 20), (80, 50), (50, 80), (20, 50)])
    bay = Polygon([(20, 20), (80, 20), (80, 80), (20, 80), (20, 70), (70, 70), (70, 30), (20, 30)])
    return {
        "island": _without(square, [box(30, 30, 70, 70)]),
        "ring": _without(shapely.Point(50, 50).buffer(50), [shapely.Point(50, 50).buffer(49)]),
        "islands in a row": _without(square, [box(40, y, 60, y + 5) for y in range(5, 95, 10)]),
        "islands in a line": _without(square, [box(x, 40, x + 5, 60) for x in range(5, 95, 10)]),
        "islands in a grid": _without(
            square, [box(x, y, x + 5, y + 5) for x in range(5, 95, 10) for y in range(5, 95, 10)]
        ),
        "diamond level with notches": _without(
            square, [diamond, Polygon([(10, 100), (20, 50), (15, 100)]), Polygon([(85, 0), (80, 30), (90, 0)])]
        ),
        "island in a bay of an island": _without(square, [bay, box(30, 40, 60, 60)]),
        "tiny islands": _without(square, [box(x, x, x + 1e-6, x + 1e-6) for x in range(10, 100, 10)]),
        "island just off the shore": _without(square, [box(1e-9, 30, 50, 70)]),
    }


def _with_pinches() -> dict[str, Polygon]:
    square = box(0, 0, 100, 100)
    tip_up = Polygon([(50, 100), (30, 50), (70, 50)])
    petals = [
        affinity.rotate(Polygon([(50, 50), (46, 20), (54, 20)]), angle, origin=(50, 50))
        for angle in range(0, 360, 45)
    ]
    notch = Polygon([(0, 0), (40, 0), (50, 40), (60, 0), (100, 0), (100, 100), (0, 100)])
    chain = [Polygon([(0, 0), (10, 10), (5, 10)]), *(box(x, x, x + 10, x + 10) for x in range(10, 90, 10))]
    return {
        "island touches the border": _without(square, [tip_up]),
        "border touches an island": _with_rings(notch, [box(40, 40, 60, 60)]),
        "corner to corner with the border": _with_rings(notch, [Polygon([(50, 40), (60, 60), (40, 60)])]),
        "islands corner to corner": _without(square, [box(30, 30, 50, 50), box(50, 50, 70, 70)]),
        "corner on an edge": _without(square, [box(30, 30, 50, 70), Polygon([(50, 50), (70, 40), (70, 60)])]),
        "petals": _without(square, petals),
        "chain of islands from the border": _with_rings(square, chain),
        "chessboard": _chessboard(),
        "all but closed bay": _without(square, [box(30, 30, 50, 50), box(50, 50, 70, 70), box(30, 70, 50, 90)]),
        "touches on all four sides": _without(
            square,
            [
                affinity.rotate(Polygon([(50, 100), (45, 80), (55, 80)]), angle, origin=(50, 50))
                for angle in (0, 90, 180, 270)
            ],
        ),
    }


def _without(water: Polygon, islands: Iterable[Polygon]) -> Polygon:
    return _largest(shapely.difference(water, shapely.union_all(list(islands))))


def _union(parts: Iterable[Polygon]) -> Polygon:
    return _largest(shapely.union_all(list(parts)))


def _largest(shape: BaseGeometry) -> Polygon:
    largest: Polygon = max(shapely.get_parts(shape), key=shapely.area)
    return largest


def _with_rings(water: Polygon, islands: Iterable[Polygon]) -> Polygon:
    """The polygon with exactly these holes: an overlay would put a vertex where rings touch."""
    return Polygon(water.exterior, [island.exterior for island in islands])


def _teeth(width: float, count: int) -> list[Place]:
    heights = 20.0 + 70.0 * np.modf(np.arange(2 * count) * 0.618)[0]
    heights[::2] = 5.0
    return list(zip(np.linspace(0.0, width, 2 * count).tolist(), heights.tolist(), strict=True))


def _spiral() -> Polygon:
    arms, low, high = [], 0.0, 100.0
    while high - low > 20.0:
        arms += [box(low, low, low + 5, high), box(low, high - 5, high, high), box(high - 5, low, high, high)]
        arms += [box(low + 10, low, high, low + 5), box(low + 10, low, low + 15, low + 15)]
        low, high = low + 10, high - 10
    return _union(arms)


def _chessboard() -> Polygon:
    """A board whose black squares are land, but for a column and two rows that keep the water together."""
    black = [box(x, y, x + 10, y + 10) for x in range(10, 90, 10) for y in range(10, 90, 10) if (x + y) % 20 == 0]
    return _without(box(0, 0, 100, 100), black)
