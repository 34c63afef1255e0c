"""The contour stage: from a site as the mission describes it to the free space."""

from __future__ import annotations

import shapely
from shapely import Polygon

from oxbow.contracts import ContourRequest, DroppedPart, FreeSpace
from oxbow.recording import Layer, LayerKind, Show
from oxbow_contour.free_space import Eroded, erode_water
from oxbow_contour.water import true_water

__all__ = ["handle"]


def handle(request: ContourRequest, show: Show) -> FreeSpace:
    """Simplify the contours, erode the water by the safety distance, keep the largest part.

    Raises
    ------
    Infeasible
        No water is left; the message names the largest safety distance that would leave some.
    """
    show(Layer(stage="contour", name="raw", geometries=(request.outline, *request.zones)))
    water = true_water(request.outline, request.zones)
    eroded = erode_water(water, request.safety_m, request.spacing_m, request.tolerance_m)
    free, *others = eroded.parts
    home = next(part for part in water if part.contains(free.representative_point()))
    shapely.prepare(home)
    dropped = tuple(_dropped(part, home) for part in others)
    _show_result(eroded, dropped, show)
    return FreeSpace(
        free=free,
        water=home,
        tolerance_m=eroded.simplified.tolerance_m,
        compression=eroded.simplified.compression,
        dropped=dropped,
        warnings=(*eroded.warnings, *_summary(dropped)),
    )


def _dropped(part: Polygon, home: Polygon) -> DroppedPart:
    place = part.representative_point()
    reason = (
        "not connected to the largest part at this safety distance"
        if home.contains(place)
        else "in water that is not connected to the largest part's"
    )
    return DroppedPart(area_m2=part.area, reason=reason, place=(place.x, place.y), outline=part)


def _summary(dropped: tuple[DroppedPart, ...]) -> tuple[str, ...]:
    if not dropped:
        return ()
    area_m2 = sum(part.area_m2 for part in dropped)
    return (f"dropped, for want of a connection to the largest part: {len(dropped)} of {area_m2:.0f} m2 together",)


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
