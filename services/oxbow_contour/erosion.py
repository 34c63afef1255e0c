"""Erosion of simplified water by the safety distance, and the check against the true shore."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from shapely import Polygon, STRtree

from oxbow_contour.simplification import Simplified

__all__ = ["TRUE_SHORE_RUN", "erode", "keeps_distance", "largest_safety_m"]

# Mitred corners keep the full distance, which the chords of GEOS's round ones do not, with half as many
# vertices; beyond 5 % more than the distance they are cut off, square to the corner.
MITRED: dict[str, Any] = {"join_style": "mitre", "mitre_limit": 1.05}
CLOSED_CORNER = (
    1e-6  # relative; GEOS joins offsets nearer than 1e-3 of the distance without a mitre (half its square)
)
ROUNDING = 1e-9  # relative, of coordinates
TRUE_SHORE_RUN = 32  # edges of the true shore that are looked at together


def erode(simplified: Simplified, safety_m: float) -> list[Polygon]:
    """Connected parts of the water farther than `safety_m` from the true contours, largest first.

    The result is conservative. Take a point p of the simplified water at a distance of at least safety + t
    from all of its contours, t being the tolerance. A strip with its rounded ends is convex and holds both its
    run of the true contour and its edge, so that the one deforms into the other within it; p, farther than t
    from the edge, is not swept over. No contour's winding number about p changes, therefore, and p is in the true
    water as it is in the simplified. Each point of the true contours is within t of a simplified one, hence
    at least `safety_m` away from p.

    Parameters
    ----------
    simplified
        Contours, and the bound on how far they are from the true ones.
    safety_m
        Least distance to keep from the true contours; 0 still keeps off them by the rounding of coordinates.
    """
    parts = np.array(simplified.parts, dtype=object)
    distance = (safety_m + simplified.tolerance_m) * (1 + CLOSED_CORNER) + _rounding(parts)
    eroded = shapely.get_parts(shapely.buffer(parts, -distance, **MITRED))
    polygons = [part for part in eroded if part.area > 0]
    return sorted(polygons, key=lambda part: (-part.area, part.bounds))


def keeps_distance(free: Polygon, water: Sequence[Polygon], safety_m: float) -> bool:
    """Whether `free` is inside the water, nowhere nearer than `safety_m` to its contours.

    It looks at the true contours, and at nothing that the simplification or the erosion found.
    """
    rings = [ring for part in water for ring in (part.exterior, *part.interiors)]
    inside = shapely.contains(np.array(water, dtype=object), free.representative_point()).any()
    holds_a_contour = shapely.contains_xy(free, [ring.coords[0] for ring in rings]).any()
    if not inside or holds_a_contour:
        return False
    edges = STRtree([edge for ring in (free.exterior, *free.interiors) for edge in _runs(ring, 1)])
    shore = np.concatenate([_runs(ring, TRUE_SHORE_RUN) for ring in rings])
    near, _ = edges.query(shore, predicate="dwithin", distance=safety_m * (1 - ROUNDING))
    return not len(near)


def largest_safety_m(water: Sequence[Polygon]) -> float:
    """A safety distance that leaves some water, nearly the largest, rounded down to three digits."""
    radius = max(shapely.length(shapely.maximum_inscribed_circle(np.array(water, dtype=object))), default=0.0)
    if radius <= 0:
        return 0.0
    digit = 10.0 ** (math.floor(math.log10(radius)) - 2)
    return math.floor(0.99 * radius / digit) * digit


def _rounding(parts: np.ndarray[Any, np.dtype[np.object_]]) -> float:
    return ROUNDING * float(np.abs(shapely.total_bounds(parts)).max())


def _runs(ring: shapely.LinearRing, count: int) -> np.ndarray[Any, np.dtype[np.object_]]:
    """A ring cut into line strings of `count` edges."""
    points = shapely.get_coordinates(ring)
    run = np.arange(len(points) - 1) // count
    first = np.flatnonzero(np.diff(run, prepend=-1))
    last = np.append(first[1:], len(points) - 1)
    repeated = np.concatenate([np.arange(a, b + 1) for a, b in zip(first, last, strict=True)])
    lines: np.ndarray[Any, np.dtype[np.object_]] = shapely.linestrings(
        points[repeated], indices=np.repeat(np.arange(len(first)), last - first + 1)
    )
    return lines
