"""Water too narrow to count, and free water too small to be a basin: what planner and certificate agree on."""

from __future__ import annotations

import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.geometry.erosion import eroded

__all__ = ["DETOUR", "direct_leg_m", "is_basin", "is_thin", "without_narrows"]

MITRE = 5.0
"""Corners of the shore stay as they are down to an angle of 23 degrees; the tips of sharper ones are narrows."""

SURPLUS = 1e-2
"""Eroded water is dilated by this share more than it was eroded: the shore is kept, not redrawn beside itself."""

DIRECT_SHARE = 3.5
"""A leg of this many safety distances is never too long: straight off the shore, with room to come alongside."""

DETOUR = 1.5
"""A leg may be this many times as long as the shortest way: it runs beside another, and clear of corners."""

THIN = 0.25
"""Free water thinner on average than this share of the least width is no basin."""


def without_narrows(water: Polygon | MultiPolygon, width_m: float) -> MultiPolygon:
    """The water that a disc of this width can be moved about in: its opening, with the shore as it was.

    Seams between a zone and a shore, spikes and rounding gaps are left out, and parts that only they connect are
    separated. Elsewhere every vertex of the shore stays where it is, at sharp corners too.

    Parameters
    ----------
    water
        Valid, in metres.
    width_m
        Narrower water is left out; at 0, nothing is.

    Returns
    -------
    MultiPolygon
        Its parts, the largest first; the water itself where it has no narrows, and empty where it is all narrow.
    """
    whole = _sorted(water)
    if width_m == 0.0:
        return whole
    core = eroded(water, width_m / 2)
    if core.is_empty:
        return MultiPolygon()
    reach_m = MITRE * width_m / 2
    shapely.prepare(core)
    # Opening is the identity where no vertex is far from the core and no part or island was lost with it. Water
    # without narrows is then returned as given, not with new vertices.
    is_reached = shapely.dwithin(core, shapely.points(shapely.get_coordinates(water)), reach_m).all()
    if is_reached and _rings(core) == _rings(water):
        return whole
    grown = core.buffer(width_m / 2 * (1.0 + SURPLUS), join_style="mitre", mitre_limit=MITRE)
    return _sorted(water.intersection(grown))


def is_basin(part: Polygon, safety_m: float, width_m: float) -> bool:
    """Whether a connected part of the free space is a basin, not a wide spot of a narrow water.

    A wide spot fits into a circle whose radius is the safety distance: a leg through narrow water may pass it. No
    leg may pass a basin, whose own free water lies nearer. A thin strip of free water is what rounding leaves
    where water is just twice the safety distance wide.

    Parameters
    ----------
    part
        In metres.
    safety_m
        The distance that paths keep from the shore.
    width_m
        The least width of water that counts; at 0, no part is too thin.

    Returns
    -------
    bool
        False also for a strip that is thin on average (`is_thin`).
    """
    radius_m = float(shapely.minimum_bounding_radius(part))
    return radius_m > max(safety_m, width_m) and not is_thin(part, width_m)


def is_thin(part: Polygon, width_m: float) -> bool:
    """Whether free water is thinner on average than a quarter of a least width: no boat can be held in it.

    Parameters
    ----------
    part
        Of positive extent, in metres.
    width_m
        The least width of water that counts; at 0, only a part without area is thin.

    Returns
    -------
    bool
        True also where the part has no area.
    """
    return bool(part.area <= THIN * width_m * 2.0 * float(shapely.minimum_bounding_radius(part)))


def direct_leg_m(safety_m: float, ashore_m: float) -> float:
    """The length, in metres, that a leg may always run near the shore, whatever its direction.

    Parameters
    ----------
    safety_m
        The distance that paths keep from the shore.
    ashore_m
        How far the place is from the water.

    Returns
    -------
    float
        3.5 safety distances, and 1.5 times the way over land.
    """
    return DIRECT_SHARE * safety_m + DETOUR * ashore_m


def _rings(water: BaseGeometry) -> tuple[int, int]:
    """How many parts and islands there are: both change where narrows connect."""
    parts = shapely.get_parts(water)
    return len(parts), int(shapely.get_num_interior_rings(parts).sum())


def _sorted(geometry: BaseGeometry) -> MultiPolygon:
    """The polygons of a geometry that have an area, the largest first."""
    parts: list[Polygon] = [part for part in shapely.get_parts(geometry) if isinstance(part, Polygon)]
    # Ties are broken by position, so that equal parts have the same order everywhere.
    largest_first = sorted(parts, key=lambda part: (-part.area, part.bounds))
    return MultiPolygon([part for part in largest_first if part.area > 0.0])
