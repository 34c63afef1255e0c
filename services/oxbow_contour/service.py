"""The contour stage: from a site as the mission describes it to the free space."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from msgspec import structs
from shapely import MultiPolygon, Polygon, STRtree

from oxbow.contracts import ContourRequest, DroppedPart, FreeSpace
from oxbow.errors import Infeasible
from oxbow.geometry.narrows import is_basin, is_thin, without_narrows
from oxbow.tolerances import ON_SHORE_M
from oxbow.wire.recording import Layer, LayerKind, Show
from oxbow_contour.basins import require_reachable
from oxbow_contour.free_space import EXACT, MANY_POINTS, Eroded, erode_water
from oxbow_contour.home import home_water
from oxbow_contour.verification import inscribed_radius_m, rounded_down
from oxbow_contour.water import true_water

__all__ = ["handle"]

MOSTLY = 0.5
"""Where a smaller share of the water is free, the free space sets the scale of detail."""

LEAST_LOST_M2 = 0.01
"""Less narrow water than this is not worth a figure."""

OTHER_PART = "not connected to the largest part at this safety distance"
OTHER_WATER = "in water that is not connected to that of the launch point"


def handle(request: ContourRequest, show: Show) -> FreeSpace:
    """Choose the water that is planned on, simplify its contours, erode it by the safety distance.

    Parameters
    ----------
    request
        The site, the distances to keep, and the places where vehicles start and are recovered.
    show
        Receives the layers `raw`, `simplified`, `eroded`, `dropped` and `figures`.

    Returns
    -------
    FreeSpace
        Its largest part, the water that it lies in, and what was dropped.

    Raises
    ------
    InvalidRequest
        A place lies too far from any water that is wide enough.
    Infeasible
        No water is left, and the message names the largest safety distance that would leave some; or the places
        lie in waters, or by basins, that are not connected.
    """
    show(Layer(stage="contour", name="raw", geometries=(request.outline, *request.zones)))
    water = MultiPolygon(true_water(request.outline, request.zones))
    # Narrows are taken out before any water is chosen: what only they connect are two waters.
    opened = _opened(water, request)
    waters = tuple(opened.geoms)
    if not waters:
        raise Infeasible(
            f"{request.least_width_m:g} m leaves no water; expected less than the water is wide",
            where="least_width_m",
        )
    # Then the one water that all vehicles are in, and only that is simplified and eroded.
    home = home_water(waters, request, water.difference(opened))
    eroded = _free_space(home, request, water.area)
    free, *others = eroded.parts
    shapely.prepare(home)
    dropped = (*_other_waters(waters, home, request), *(_dropped(part, OTHER_PART) for part in others))
    _show_result(eroded, dropped, show)
    return FreeSpace(
        free=free,
        water=home,
        tolerance_m=eroded.simplified.tolerance_m,
        compression=eroded.simplified.compression,
        dropped=dropped,
        warnings=(*eroded.warnings, *_narrow(water, opened, request), *_summary(dropped)),
    )


def _opened(water: MultiPolygon, request: ContourRequest) -> MultiPolygon:
    """The water without narrows; as it is, where they part nothing and the safety distance leaves them out."""
    opened = without_narrows(water, request.least_width_m)
    if 2 * request.safety_m < request.least_width_m or not _are_one_of_each(opened, water):
        return opened
    places = shapely.points(np.reshape(request.places, (-1, 2)))
    # A place in narrows makes them matter: how far it lies from water that counts is checked next.
    in_narrows = shapely.distance(places, opened) > shapely.distance(places, water) + ON_SHORE_M
    return opened if in_narrows.any() else without_narrows(water, 0.0)


def _are_one_of_each(opened: MultiPolygon, water: MultiPolygon) -> bool:
    """Whether narrows neither part nor make up any of the waters."""
    inside = shapely.point_on_surface(shapely.get_parts(opened))
    _, holder = STRtree(shapely.get_parts(water)).query(inside, predicate="intersects")
    return len(inside) == len(np.unique(holder)) == len(water.geoms)


def _free_space(home: Polygon, request: ContourRequest, area_m2: float) -> Eroded:
    """The free space, at the scale of detail that the length gives there.

    The nominal spacing is that of all the water. Where little of it is free, that is too coarse.
    """
    eroded = _eroded(home, request)
    share = eroded.parts[0].area / area_m2
    if share >= MOSTLY:
        return eroded
    return _eroded(home, structs.replace(request, spacing_m=share * request.spacing_m))


def _eroded(home: Polygon, request: ContourRequest) -> Eroded:
    """The free space of the water that is planned on, within reach of every place."""
    eroded = erode_water([home], request.safety_m, request.spacing_m, request.tolerance_m)
    try:
        _require_breadth(eroded.parts, home, request)
        require_reachable(eroded.parts, home, request)
    except Infeasible:
        # Simplification may have closed what the safety distance leaves open.
        if eroded.simplified.tolerance_m == 0.0 or shapely.get_num_coordinates(home) > MANY_POINTS:
            raise
        eroded = erode_water([home], request.safety_m, request.spacing_m, tolerance_m=0.0)
        _require_breadth(eroded.parts, home, request)
        require_reachable(eroded.parts, home, request)
    return eroded


def _require_breadth(parts: Sequence[Polygon], home: Polygon, request: ContourRequest) -> None:
    """Raise `Infeasible` where the safety distance leaves nothing, or no more than a seam.

    In a canal of just twice the safety distance, rounding decides where there is free water, and no boat keeps
    to the middle so well.
    """
    safety_m, width_m = request.safety_m, request.least_width_m
    if safety_m == 0.0:
        if not parts:
            raise Infeasible("leaves no water wider than rounding errors", where="outline")
    elif not parts or is_thin(parts[0], width_m):
        radius_m = min(safety_m, inscribed_radius_m([home], EXACT * safety_m))
        # Half the least width less, so that what is left is no seam; rounded down, so that it works as it is
        # printed.
        less_m = rounded_down(max((1.0 - EXACT) * radius_m - width_m / 2, 0.0), digits=4)
        narrow = f" wider than {width_m:g} m, `least_width_m`" if width_m else ""
        raise Infeasible(
            f"is {safety_m:g} m, which leaves no free water{narrow}; expected less, such as {less_m:g} m",
            where="safety_m",
        )


def _other_waters(waters: Sequence[Polygon], home: Polygon, request: ContourRequest) -> Iterator[DroppedPart]:
    """The waters that are not planned on, except for what is too small to matter."""
    for part in waters:
        if part is not home and is_basin(part, request.safety_m, request.least_width_m):
            yield _dropped(part, OTHER_WATER)


def _dropped(part: Polygon, reason: str) -> DroppedPart:
    place = part.representative_point()
    return DroppedPart(area_m2=part.area, reason=reason, place=(place.x, place.y), outline=part)


def _narrow(water: MultiPolygon, opened: MultiPolygon, request: ContourRequest) -> tuple[str, ...]:
    # Compared vertex by vertex: water without narrows comes back as it was, in the same order.
    if opened.equals_exact(without_narrows(water, 0.0), tolerance=0.0):
        return ()
    lost_m2 = max(water.area - opened.area, 0.0)
    lost = f"{lost_m2:.2g} m2 in all" if lost_m2 >= LEAST_LOST_M2 else "seams without an area"
    return (f"water narrower than `least_width_m` = {request.least_width_m:g} m is left out: {lost}",)


def _summary(dropped: tuple[DroppedPart, ...]) -> tuple[str, ...]:
    if not dropped:
        return ()
    area_m2 = sum(part.area_m2 for part in dropped)
    parts = "1 part" if len(dropped) == 1 else f"{len(dropped)} parts"
    return (f"dropped {parts}, {area_m2:.0f} m2 in all, not connected to the water that is planned on",)


def _show_result(eroded: Eroded, dropped: tuple[DroppedPart, ...], show: Show) -> None:
    simplified = eroded.simplified
    contours = tuple(shapely.boundary(part) for part in simplified.parts)
    show(Layer(stage="contour", name="simplified", geometries=contours))
    show(Layer(stage="contour", name="eroded", geometries=(eroded.parts[0],)))
    if dropped:
        outlines = tuple(part.outline for part in dropped)
        labels = tuple(f"{part.area_m2:.0f} m²" for part in dropped)
        show(Layer(stage="contour", name="dropped", geometries=outlines, labels=labels))
    figures = {"compression": simplified.compression, "tolerance_m": simplified.tolerance_m}
    show(Layer(stage="contour", name="figures", kind=LayerKind.SCALARS, scalars=figures))
