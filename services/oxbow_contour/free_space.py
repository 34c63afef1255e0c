"""Free space: true water simplified, eroded, checked, and refined where that lost an arm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon

from oxbow.errors import Internal
from oxbow.tolerances import DISTANCE_ROUNDING
from oxbow_contour.erosion import erode
from oxbow_contour.simplification import Simplified, simplify
from oxbow_contour.verification import inscribed_radius_m, is_safe

__all__ = ["EXACT", "MANY_POINTS", "Eroded", "default_tolerance_m", "erode_water"]

REACH = 0.25
"""How far, in spacings, water that erosion may leave can be from the free space; farther, it is an arm lost."""

MANY_POINTS, TOO_MANY_POINTS = 50_000, 200_000
"""Contours of more points than the first are simplified more coarsely, to a bound, and not refined for the sake of
an arm; those of more than the second, without a bound: eroding them would take minutes.
"""

COARSEST, FINEST = 1 / 20, 1 / 2000
"""Bounds, in spacings, on tolerances that are made coarser or finer; what would be finer still is exact."""

SLACK = 1 / 4
"""How far, in tolerances, eroded contours are simplified once more: their round corners are many short edges.
Round corners are eroded as far too much, at most.
"""

EXACT = 1e-4
"""How much of the largest safety distance may be lost to erosion, relative."""


@dataclass(frozen=True)
class Eroded:
    """The connected parts of the free space, largest first, and the contours that they were eroded from.

    There are none where the safety distance leaves nothing.
    """

    parts: tuple[Polygon, ...]
    simplified: Simplified
    warnings: tuple[str, ...] = ()


def default_tolerance_m(safety_m: float, spacing_m: float) -> float:
    """A tolerance that costs a strip of water negligible beside the spacing.

    That is half a percent of the spacing, or a twentieth of the safety distance where that is more, but at most
    one percent of the spacing.

    Parameters
    ----------
    safety_m
        Distance to keep from the shore.
    spacing_m
        The nominal spacing.

    Returns
    -------
    float
        In metres.
    """
    return float(np.clip(safety_m / 20, spacing_m / 200, spacing_m / 100))


def erode_water(
    water: Sequence[Polygon], safety_m: float, spacing_m: float, tolerance_m: float | None = None
) -> Eroded:
    """Free space of the true water, from contours refined until their simplification closes no arm of it.

    Parameters
    ----------
    water
        Parts of the true water, in metres.
    safety_m, spacing_m
        Distance to keep from the contours, and between transects.
    tolerance_m
        Half width of the first strips; by default `default_tolerance_m`, or coarser for very long contours.

    Returns
    -------
    Eroded
        Without parts where the safety distance leaves nothing.

    Raises
    ------
    Internal
        The result is not safe, not even from the true contours.
    """
    asked_m = default_tolerance_m(safety_m, spacing_m) if tolerance_m is None else tolerance_m
    simplified = simplify(water, asked_m)
    # Coarser first, where the planner may choose; a tolerance that was asked for is kept.
    while tolerance_m is None and _is_too_long(simplified, spacing_m):
        simplified = simplify(water, 4 * simplified.tolerance_m)
    # Not after it was made coarser: finer contours would be too long again, and the loop would not end.
    may_refine = simplified.tolerance_m <= asked_m and simplified.points_out <= MANY_POINTS
    while True:
        parts = _shrunk(simplified, safety_m)
        if not parts:
            # Nothing is left: because there is no room, or only because the contours were simplified too coarsely.
            if simplified.tolerance_m == 0 or not _has_room(water, safety_m):
                return Eroded(parts=(), simplified=simplified)
        elif is_safe(parts[0], water, safety_m):
            if not (may_refine and _closes_arms(simplified, parts[0], safety_m, spacing_m)):
                return Eroded(parts=tuple(parts), simplified=simplified, warnings=_warnings(simplified, asked_m))
        # Nothing finer is left to try: an unsafe result from the true contours is a fault of this stage.
        elif simplified.tolerance_m == 0:
            raise Internal(f"free space is nearer than {safety_m:g} m to the shore", where="contour")
        simplified = simplify(water, _finer_m(simplified.tolerance_m, spacing_m))


def _is_too_long(simplified: Simplified, spacing_m: float) -> bool:
    bound = MANY_POINTS if simplified.tolerance_m < COARSEST * spacing_m else TOO_MANY_POINTS
    return simplified.points_out > bound


def _finer_m(tolerance_m: float, spacing_m: float) -> float:
    return tolerance_m / 4 if tolerance_m > FINEST * spacing_m else 0.0


def _shrunk(simplified: Simplified, safety_m: float) -> list[Polygon]:
    """Connected parts of the water farther than `safety_m` from the true contours, largest first.

    The result is conservative. Take a point p of the simplified water at a distance of at least safety + t
    from all of its contours, t being the tolerance. A strip with its rounded ends is convex and holds both its
    run of the true contour and its edge, so that the one deforms into the other within it; p, farther than t
    from the edge, is not swept over. No contour's winding number about p changes, therefore, and p is in the true
    water as it is in the simplified. Each point of the true contours is within t of a simplified one, hence
    at least `safety_m` away from p. The new contours, in turn, are simplified within a slack eroded before.
    """
    rounding_m = DISTANCE_ROUNDING * simplified.extent_m
    slack_m = SLACK * simplified.tolerance_m + rounding_m
    parts = erode(simplified.parts, safety_m + simplified.tolerance_m + slack_m + rounding_m, slack_m)
    return [part for part in shapely.simplify(parts, slack_m) if part.area > 0]


def _closes_arms(simplified: Simplified, free: Polygon, safety_m: float, spacing_m: float) -> bool:
    """Whether the tolerance may have cost more than a strip along the shore.

    What erosion leaves of the true water lies between what it leaves of the simplified at safety + t, which is
    `free`, and at safety - t. Where all of the latter's largest part is near the former, so is what lies between.
    """
    if simplified.tolerance_m == 0 or simplified.points_out > MANY_POINTS:
        return False
    least_m = safety_m - simplified.tolerance_m
    outer = erode(simplified.parts, least_m, SLACK * simplified.tolerance_m) if least_m > 0 else simplified.parts
    largest = max(outer, key=shapely.area)
    # A buffer's chords lie inside the true one: at worst, an arm is reported that is none.
    return not free.buffer(REACH * spacing_m).covers(largest)


def _has_room(water: Sequence[Polygon], safety_m: float) -> bool:
    """Whether a circle of that radius fits into the water."""
    precision_m = EXACT * safety_m
    return inscribed_radius_m(water, precision_m) + precision_m >= safety_m > 0.0


def _warnings(simplified: Simplified, asked_m: float) -> tuple[str, ...]:
    tolerance_m, points = simplified.tolerance_m, simplified.points_out
    warnings = []
    if tolerance_m < asked_m:
        warnings.append(f"contours are simplified to {tolerance_m:g} m: {asked_m:g} m might have closed an arm")
    if tolerance_m > asked_m:
        warnings.append(f"contours are simplified to {tolerance_m:g} m: at {asked_m:g} m they had too many points")
    if tolerance_m > asked_m or (tolerance_m > 0 and points > MANY_POINTS):
        warnings.append("the contours are very long: it was not checked whether simplification closes an arm")
    return tuple(warnings)
