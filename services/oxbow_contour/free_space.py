"""From the true site to its free space: water, simplification, erosion, parts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon

from oxbow.errors import Infeasible, Internal
from oxbow_contour.erosion import erode, keeps_distance, largest_safety_m
from oxbow_contour.simplification import Simplified, simplify

__all__ = ["Eroded", "default_tolerance_m", "erode_water", "true_water"]

EXACT_POINTS = 20_000
"""Contours of at most so many points may be eroded without being simplified: it takes some tenths of a second."""

REACH = 0.25
"""How far (in spacings) eroded true water may be from the free space kept; farther, the tolerance is too coarse."""


@dataclass(frozen=True)
class Eroded:
    """The connected parts of the free space, largest first, and the contours that they were eroded from."""

    parts: tuple[Polygon, ...]
    simplified: Simplified
    warnings: tuple[str, ...] = ()


def true_water(outline: Polygon, zones: Sequence[Polygon]) -> tuple[Polygon, ...]:
    """The parts of the outline that no zone covers, not simplified.

    Raises
    ------
    Infeasible
        The zones cover the whole outline.
    """
    water = outline.difference(shapely.union_all(list(zones)))
    parts = tuple(part for part in shapely.get_parts(water) if isinstance(part, Polygon) and part.area > 0)
    if not parts:
        raise Infeasible("cover the whole outline and leave no water", where="ForbiddenZones")
    return parts


def default_tolerance_m(safety_m: float, spacing_m: float) -> float:
    """A tolerance that costs a strip of water negligible beside the spacing.

    That is half a percent of the spacing, or a twentieth of the safety distance where that is more, but at most
    one percent of the spacing.
    """
    return float(np.clip(safety_m / 20, spacing_m / 200, spacing_m / 100))


def erode_water(water: Sequence[Polygon], safety_m: float, spacing_m: float, tolerance_m: float) -> Eroded:
    """Free space of the true water, at the coarsest tolerance up to `tolerance_m` that keeps its arms connected.

    Raises
    ------
    Infeasible
        Nothing is left at this safety distance.
    Internal
        The result is not safe, even with true contours.
    """
    reference = _exact_largest(water, safety_m)
    warnings: list[str] = []
    for tolerance in _tolerances(tolerance_m, spacing_m):
        simplified = simplify(water, tolerance)
        parts = erode(simplified, safety_m)
        if not parts or (tolerance > 0 and _loses_arms(parts[0], reference, REACH * spacing_m)):
            continue
        if keeps_distance(parts[0], water, safety_m):
            if tolerance < tolerance_m:
                warnings.append(
                    f"tolerance reduced from {tolerance_m:g} to {tolerance:g} m to keep narrow arms open"
                )
            return Eroded(parts=tuple(parts), simplified=simplified, warnings=tuple(warnings))
    if parts:
        raise Internal(f"free space nearer than {safety_m:g} m to the shore", where="contour")
    largest = largest_safety_m(water)
    raise Infeasible(f"safety_m = {safety_m:g} leaves no water; at most {largest:g} m would", where="Safety")


def _tolerances(tolerance_m: float, spacing_m: float) -> Iterator[float]:
    while tolerance_m > spacing_m / 2000:
        yield tolerance_m
        tolerance_m /= 4
    yield 0.0


def _exact_largest(water: Sequence[Polygon], safety_m: float) -> Polygon | None:
    if shapely.get_num_coordinates(list(water)).sum() > EXACT_POINTS:
        return None
    parts = shapely.get_parts(shapely.buffer(list(water), -safety_m, quad_segs=16))
    return max(parts, key=lambda part: part.area, default=None)


def _loses_arms(free: Polygon, reference: Polygon | None, reach_m: float) -> bool:
    if reference is None or reference.is_empty:
        return False
    shapely.prepare(free)
    return not shapely.dwithin(free, shapely.points(shapely.get_coordinates(reference)), reach_m).all()
