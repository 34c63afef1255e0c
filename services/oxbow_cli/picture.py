"""A picture of a completed Mission File: the water, what keeps the path off it, and the path."""

from __future__ import annotations

import io
import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import shapely
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, PathPatch
from matplotlib.patches import Polygon as PolygonPatch
from matplotlib.path import Path as Outline
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.contracts import FloatArray, Place
from oxbow.errors import InvalidMission
from oxbow.files import write_atomically
from oxbow.frame import lonlat
from oxbow.mission import Mission
from oxbow.site import Site
from oxbow_certificate.erosion import eroded

__all__ = ["draw"]

FORMATS = {".png": "png", ".svg": "svg"}

LAND, WATER, MARGIN, SHORE, INK = "#f4f0e6", "#d3e6ef", "#e6f0f3", "#7d8f96", "#24343b"
FORBIDDEN, FORBIDDEN_EDGE, GAP = "#e8d8c3", "#b5805a", "#c8322b"
PROGRESS = "viridis"
_COLOURS = 256
_DPI = 200
_HEADER_IN, _FOOTER_IN = 0.85, 0.75
_HALO = [patheffects.withStroke(linewidth=2.5, foreground="white")]


def draw(mission: Mission, path: Path, *, width_px: int = 2000) -> None:
    """Draw a mission to a PNG or SVG file; one that has no path yet is drawn as its site alone, which it says.

    Parameters
    ----------
    mission
        A Mission File, completed or not.
    path
        The picture's file, replaced as a whole; its suffix chooses the format.
    width_px
        Width of the picture; its height follows from the site.

    Raises
    ------
    InvalidMission
        The suffix is none of the two, the width is not positive, or the site is not valid.
    """
    if path.suffix.lower() not in FORMATS:
        raise InvalidMission(f"is {str(path)!r}; expected a name that ends in .png or .svg", where="--output")
    if width_px < 1:
        raise InvalidMission(f"is {width_px}; expected a width of at least 1 pixel", where="width_px")
    site = Site.of(mission)
    figure, axes = _sheet(site)
    _draw_site(axes, site, mission.safety_m)
    if mission.master_path:
        _draw_path(axes, site.frame.to_planar(lonlat(mission.master_path)), site.nominal_spacing_m)
        _draw_progress_key(figure)
    _draw_findings(axes, mission, site)
    _draw_ends(axes, site)
    _draw_scale_and_north(axes)
    _draw_header(figure, mission)
    picture = io.BytesIO()
    metadata = {"Date": None} if path.suffix.lower() == ".svg" else {}
    figure.savefig(picture, format=FORMATS[path.suffix.lower()], dpi=_DPI * width_px / 2000, metadata=metadata)
    write_atomically(path, picture.getvalue())


def _sheet(site: Site) -> tuple[Figure, Axes]:
    """A sheet of fixed width in inches, as tall as the site needs, and the map's axes in metres."""
    west, south, east, north = shapely.union_all(
        [site.outline, shapely.Point(site.launch), shapely.Point(site.recovery)]
    ).bounds
    margin = 0.04 * max(east - west, north - south)
    width_m, height_m = east - west + 2 * margin, north - south + 2 * margin
    width_in = 2000 / _DPI
    map_in = width_in * min(max(height_m / width_m, 0.4), 1.25)
    height_in = map_in + _HEADER_IN + _FOOTER_IN
    figure = Figure(figsize=(width_in, height_in), facecolor=LAND)
    axes = figure.add_axes((0, _FOOTER_IN / height_in, 1, map_in / height_in))
    metres_per_in = max(width_m / width_in, height_m / map_in)
    centre_x, centre_y = (west + east) / 2, (south + north) / 2
    axes.set_xlim(centre_x - metres_per_in * width_in / 2, centre_x + metres_per_in * width_in / 2)
    axes.set_ylim(centre_y - metres_per_in * map_in / 2, centre_y + metres_per_in * map_in / 2)
    axes.set_axis_off()
    return figure, axes


def _draw_site(axes: Axes, site: Site, safety_m: float) -> None:
    water = site.outline.difference(shapely.union_all(site.zones))
    if not isinstance(water, Polygon | MultiPolygon):
        raise InvalidMission("leaves no water within the outline", where="ForbiddenZones")
    pixel_m = (axes.get_xlim()[1] - axes.get_xlim()[0]) / 2000
    axes.add_patch(_patch(site.outline, facecolor=FORBIDDEN, edgecolor="none", zorder=1))
    axes.add_patch(
        _patch(
            shapely.union_all(site.zones).intersection(site.outline),
            facecolor="none",
            edgecolor=FORBIDDEN_EDGE,
            hatch="//////",
            linewidth=0,
            zorder=1.5,
        )
    )
    axes.add_patch(_patch(water, facecolor=MARGIN, edgecolor=SHORE, linewidth=0.7, zorder=2))
    axes.add_patch(_patch(eroded(water, safety_m, pixel_m / 4), facecolor=WATER, edgecolor="none", zorder=3))


def _patch(geometry: BaseGeometry, **style: object) -> PathPatch:
    """Polygons, holes and all, as one patch."""
    polygons = [part for part in shapely.get_parts(geometry) if isinstance(part, Polygon)]
    rings = [ring for polygon in polygons for ring in (polygon.exterior, *polygon.interiors)]
    outlines = [Outline(shapely.get_coordinates(ring), closed=True) for ring in rings if not ring.is_empty]
    return PathPatch(Outline.make_compound_path(*outlines), **style)


def _draw_path(axes: Axes, xy: FloatArray, spacing_m: float) -> None:
    """The path in pieces of equal length, each of one colour; its legs are kept apart whatever the spacing."""
    points_per_m = (
        axes.figure.get_window_extent().width / axes.figure.dpi * 72 / (axes.get_xlim()[1] - axes.get_xlim()[0])
    )
    axes.add_collection(
        LineCollection(
            _pieces(xy),
            cmap=PROGRESS,
            array=np.linspace(0, 1, _COLOURS),
            linewidths=min(max(0.3 * spacing_m * points_per_m, 0.35), 1.6),
            capstyle="round",
            joinstyle="round",
            zorder=4,
        ),
        autolim=False,
    )


def _pieces(xy: FloatArray) -> list[FloatArray]:
    """A path cut at equal steps of its length."""
    at = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])
    cuts = np.linspace(0.0, at[-1], _COLOURS + 1)
    ends = np.column_stack([np.interp(cuts, at, xy[:, axis]) for axis in (0, 1)])
    first = np.searchsorted(at, cuts, side="right")
    return [
        np.vstack([ends[k], xy[start : max(start, np.searchsorted(at, cuts[k + 1]))], ends[k + 1]])
        for k, (start, _) in enumerate(pairwise(first))
    ]


def _draw_findings(axes: Axes, mission: Mission, site: Site) -> None:
    """What the plan says it leaves out, and the disc that its worst gap would hold."""
    if mission.plan is None:
        return
    for part in mission.plan.dropped:
        place = site.frame.to_planar(lonlat([part.place]))[0]
        axes.plot(*place, marker="x", markersize=7, markeredgewidth=1.8, color=GAP, zorder=6)
        _note(axes, (place[0], place[1]), f"dropped {_area(part.area_m2)}", colour=GAP)
    certificate = mission.plan.certificate
    if certificate.worst_gap is not None:
        x, y = site.frame.to_planar(lonlat([certificate.worst_gap]))[0]
        radius_m = certificate.cover_radius_m[0]
        axes.add_patch(
            Circle(
                (x, y), radius_m, facecolor="none", edgecolor=GAP, linewidth=1.1, linestyle=(0, (3, 2)), zorder=6
            )
        )
        _note(axes, (x, y + radius_m), f"widest gap {_distance(radius_m)}", colour=GAP)


def _draw_ends(axes: Axes, site: Site) -> None:
    together = math.dist(site.launch, site.recovery) < 1.0
    ends = [(site.launch, "o", "launch and recovery" if together else "launch")]
    if not together:
        ends.append((site.recovery, "s", "recovery"))
    for place, marker, label in ends:
        axes.plot(
            *place, marker=marker, markersize=7, color="white", markeredgecolor=INK, markeredgewidth=1.6, zorder=7
        )
        _note(axes, place, label, colour=INK)


def _note(axes: Axes, place: Place, text: str, *, colour: str) -> None:
    """A label beside a place, on the side that has room."""
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
        zorder=8,
    )


def _draw_scale_and_north(axes: Axes) -> None:
    """A scale bar of a round length and an arrow to the north, below the map."""
    (west, east), (south, north) = axes.get_xlim(), axes.get_ylim()
    bar_m = _round_down(0.2 * (east - west))
    x, y = west + 0.04 * (east - west), south - 0.35 * _FOOTER_IN * (north - south) / _map_height_in(axes)
    height_m = 0.004 * (east - west)
    for part, colour in enumerate((INK, "white", INK, "white")):
        axes.add_patch(
            PolygonPatch(
                shapely.get_coordinates(
                    shapely.box(x + part * bar_m / 4, y, x + (part + 1) * bar_m / 4, y + height_m)
                ),
                facecolor=colour,
                edgecolor=INK,
                linewidth=0.6,
                clip_on=False,
            )
        )
    axes.text(x + bar_m + 0.01 * (east - west), y, _distance(bar_m), fontsize=8, color=INK, va="baseline")
    axes.annotate(
        "N",
        xy=(0.965, 0.985),
        xytext=(0.965, 0.985 - 0.55 / _map_height_in(axes)),
        xycoords="axes fraction",
        ha="center",
        va="center",
        color=INK,
        fontsize=10,
        arrowprops={"arrowstyle": "-|>", "color": INK, "linewidth": 1.4},
    )


def _map_height_in(axes: Axes) -> float:
    return float(axes.get_position().height * axes.figure.get_window_extent().height / axes.figure.dpi)


def _draw_progress_key(figure: Figure) -> None:
    key = figure.add_axes((0.74, 0.32 / figure.get_figheight(), 0.14, 0.09 / figure.get_figheight()))
    key.imshow(np.linspace(0, 1, _COLOURS)[None, :], aspect="auto", cmap=PROGRESS)
    key.set_axis_off()
    for x, text, side in ((-0.04, "start", "right"), (1.04, "end", "left")):
        key.text(x, 0.5, text, transform=key.transAxes, ha=side, va="center", fontsize=8, color=INK)


def _draw_header(figure: Figure, mission: Mission) -> None:
    top = 1 - 0.38 / figure.get_figheight()
    figure.text(0.04, top, mission.site_name or "Survey mission", fontsize=15, weight="bold", color=INK)
    figure.text(0.04, top - 0.27 / figure.get_figheight(), _figures(mission), fontsize=9.5, color=INK)


def _figures(mission: Mission) -> str:
    """The line below the title: what was planned, how densely, and how near it is to the best possible."""
    if not mission.master_path:
        return "no path yet: the site alone"
    if mission.plan is None:
        return "a path without a record of its planning"
    plan = mission.plan
    dropped = f"   dropped {_area(sum(part.area_m2 for part in plan.dropped))}" if plan.dropped else ""
    return (
        f"{plan.method} path {_distance(plan.length_m)}   spacing {_distance(plan.spacing_m)}"
        f"   q {plan.certificate.q:.2f}   p95 {plan.certificate.p95_ratio:.2f}{dropped}"
    )


def _round_down(length_m: float) -> float:
    """The longest of 1, 2 and 5 times a power of ten that is not above a length."""
    power = 10.0 ** math.floor(math.log10(length_m))
    return max(step * power for step in (1, 2, 5) if step * power <= length_m)


def _distance(length_m: float) -> str:
    return f"{length_m / 1000:,.4g} km" if length_m >= 1000 else f"{length_m:.3g} m"


def _area(area_m2: float) -> str:
    return f"{area_m2 / 1e6:.3g} km²" if area_m2 >= 1e4 else f"{area_m2:.3g} m²"
