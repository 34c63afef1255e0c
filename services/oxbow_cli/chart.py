"""What is drawn on the map of a mission: water and land, where paths begin and end, labels and gaps."""

from __future__ import annotations

import math
from collections.abc import Iterator

import shapely
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path as Outline
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import Place
from oxbow.errors import InvalidMission
from oxbow.site.site import Site
from oxbow_certificate.erosion import eroded_water
from oxbow_cli.sheet import INK

__all__ = ["GAP", "draw_disc", "draw_ends", "draw_site", "labelled_area", "line_width", "note", "patch"]

WATER, MARGIN, SHORE = "#d3e6ef", "#e6f0f3", "#7d8f96"
FORBIDDEN, FORBIDDEN_EDGE, GAP = "#e8d8c3", "#b5805a", "#c8322b"
_TOGETHER_M = 1.0
"""Ends of paths nearer to each other than this are drawn as one."""
_HALO = [patheffects.withStroke(linewidth=2.5, foreground="white")]


def draw_site(axes: Axes, site: Site, safety_m: float) -> None:
    """Draw land, zones, water within the safety distance, and the rest of the water.

    Parameters
    ----------
    axes
        The map.
    site
        What is drawn.
    safety_m
        The safety distance.

    Raises
    ------
    InvalidMission
        The zones leave no water.
    """
    water = site.outline.difference(shapely.union_all(site.zones))
    if not isinstance(water, Polygon | MultiPolygon):
        raise InvalidMission("leaves no water within the outline", where="ForbiddenZones")
    pixel_m = (axes.get_xlim()[1] - axes.get_xlim()[0]) / 2000
    axes.add_patch(patch(site.outline, facecolor=FORBIDDEN, edgecolor="none", zorder=1))
    axes.add_patch(
        patch(
            shapely.union_all(site.zones).intersection(site.outline),
            facecolor="none",
            edgecolor=FORBIDDEN_EDGE,
            hatch="//////",
            linewidth=0,
            zorder=1.5,
        )
    )
    axes.add_patch(patch(water, facecolor=MARGIN, edgecolor=SHORE, linewidth=0.7, zorder=2))
    axes.add_patch(patch(eroded_water(water, safety_m, pixel_m / 4), facecolor=WATER, edgecolor="none", zorder=3))


def patch(geometry: BaseGeometry, **style: object) -> PathPatch:
    """Polygons with their holes as one patch; `style` is that of `PathPatch`."""
    polygons = [part for part in shapely.get_parts(geometry) if isinstance(part, Polygon)]
    rings = [ring for polygon in polygons for ring in (polygon.exterior, *polygon.interiors)]
    # One compound path, not polygons over polygons: a hole must show what is below, not the colour of land.
    outlines = [Outline(shapely.get_coordinates(ring), closed=True) for ring in rings if not ring.is_empty]
    return PathPatch(Outline.make_compound_path(*outlines), **style)


def draw_ends(axes: Axes, site: Site) -> None:
    """Draw the launch and recovery points, and those that a vehicle has of its own.

    Parameters
    ----------
    axes
        The map.
    site
        The site.
    """
    drawn: list[Place] = []
    for place, marker, label in _ends(site):
        if any(math.dist(place, other) < _TOGETHER_M for other in drawn):
            continue
        drawn.append(place)
        axes.plot(
            *place, marker=marker, markersize=7, color="white", markeredgecolor=INK, markeredgewidth=1.6, zorder=7
        )
        note(axes, place, label, colour=INK)


def _ends(site: Site) -> Iterator[tuple[Place, str, str]]:
    """Where paths may start and end: place, marker and label, the mission's own first."""
    pairs = [("", site.launch, site.recovery)]
    vehicles = [member.vehicle for member in site.members if member.is_named]
    pairs += [(f"{vehicle.name}: ", vehicle.start, vehicle.recovery) for vehicle in vehicles]
    for name, launch, recovery in pairs:
        together = math.dist(launch, recovery) < _TOGETHER_M
        yield launch, "o", f"{name}launch and recovery" if together else f"{name}launch"
        yield recovery, "s", f"{name}recovery"


def note(axes: Axes, place: Place, text: str, *, colour: str) -> None:
    """Write a label beside a place, on the side that has room.

    Parameters
    ----------
    axes
        The map.
    place
        What is labelled, in metres.
    text
        Plain text.
    colour
        Of the text.
    """
    west, east = axes.get_xlim()
    right = place[0] < west + 0.8 * (east - west)
    axes.annotate(
        text,
        place,
        xytext=(7 if right else -7, 5),
        textcoords="offset points",
        ha="left" if right else "right",
        fontsize=8,
        color=colour,
        path_effects=_HALO,
        parse_math=False,
        zorder=8,
    )


def labelled_area(axes: Axes) -> BaseGeometry:
    """The area that the labels on a map cover, in metres of the map."""
    to_data = axes.transData.inverted()
    corners = [to_data.transform(text.get_window_extent().get_points()) for text in axes.texts]
    return shapely.union_all([shapely.box(*low, *high) for low, high in corners])


def line_width(axes: Axes, spacing_m: float) -> float:
    """The width of a line that keeps legs apart, in points; within limits that can be seen.

    Parameters
    ----------
    axes
        The map.
    spacing_m
        The spacing of legs.

    Returns
    -------
    float
        In points, from 0.35 to 1.6.
    """
    west, east = axes.get_xlim()
    points_per_m = axes.figure.get_window_extent().width / axes.figure.dpi * 72 / (east - west)
    return min(max(0.3 * spacing_m * points_per_m, 0.35), 1.6)


def draw_disc(axes: Axes, place: Place, radius_m: float) -> None:
    """Draw the disc that fits in a gap.

    Parameters
    ----------
    axes
        The map.
    place
        Its centre, in metres.
    radius_m
        Its radius.
    """
    axes.add_patch(
        Circle(place, radius_m, facecolor="none", edgecolor=GAP, linewidth=1.1, linestyle=(0, (3, 2)), zorder=6)
    )
