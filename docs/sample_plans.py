"""Six paths of one length over one square: three good ones, and three that a single measure would not find out."""

from __future__ import annotations

import numpy as np
from shapely import LineString, Polygon, box

from oxbow.arrays import FloatArray

__all__ = ["SQUARE", "sample_plans"]

SIDE_M = 1000.0
SQUARE: Polygon = box(0.0, 0.0, SIDE_M, SIDE_M)

_ORDER = 4
_COUNT = 2**_ORDER
_STEP_M = SIDE_M / _COUNT
_LENGTH_M = (_COUNT**2 - 1) * _STEP_M


def sample_plans() -> dict[str, LineString]:
    """The paths by name; the good ones visit the same 256 places."""
    even = (np.arange(_COUNT) + 0.5) * _STEP_M
    crowded = even[0] + (even[-1] - even[0]) * np.linspace(0.0, 1.0, _COUNT) ** 1.7
    return {
        "Even transects": _rows(even, even[0], even[-1]),
        "A spiral": _on_grid(_spiral()),
        "Hilbert's curve": _on_grid(_hilbert(_ORDER)),
        "Crowded transects": _rows(crowded, even[0], even[-1]),
        "A third left out": _rows(np.linspace(even[0], even[-1], 24), even[0], even[0] + 625.0),
        "Random waypoints": _random_waypoints(),
    }


def _rows(heights: FloatArray, west: float, east: float) -> LineString:
    ends = np.where(np.arange(len(heights))[:, None] % 2 == 0, [west, east], [east, west])
    return LineString(np.column_stack([ends.ravel(), np.repeat(heights, 2)]))


def _on_grid(cells: FloatArray) -> LineString:
    return LineString((cells + 0.5) * _STEP_M).simplify(0.0)


def _spiral() -> FloatArray:
    """Cells inwards, ring by ring; each side of a ring is one cell shorter than the last but one."""
    sides = [_COUNT - 1, *(side for side in range(_COUNT - 1, 0, -1) for _ in range(2))]
    directions = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])
    steps = directions[np.arange(len(sides)) % 4] * np.array(sides)[:, None]
    return np.concatenate([[(0, 0)], np.cumsum(steps, axis=0)]).astype(float)


def _hilbert(order: int) -> FloatArray:
    """Cells in the order of Hilbert's curve (Hilbert 1891): four smaller curves, the outer two turned."""
    if order == 0:
        return np.zeros((1, 2))
    part, half = _hilbert(order - 1), 2.0 ** (order - 1)
    turned = part[:, ::-1]
    last = np.array([2 * half - 1, half - 1]) - turned
    return np.concatenate([turned, part + np.array([0, half]), part + half, last])


def _random_waypoints() -> LineString:
    places = np.random.default_rng(2).uniform(0.5 * _STEP_M, SIDE_M - 0.5 * _STEP_M, size=(100, 2))
    at = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(places, axis=0).T))])
    whole = int(np.searchsorted(at, _LENGTH_M))
    last = [np.interp(_LENGTH_M, at, places[:, axis]) for axis in (0, 1)]
    return LineString(np.vstack([places[:whole], last]))
