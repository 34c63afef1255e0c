"""A map of a mission's gaps: the water coloured by its distance to the paths.

Of a survey it is the whole free space, in units of the least radius that paths of the same length could have: blue
is what the best of them would leave, warm colours are beyond it. Of a treatment it is the hot spots, in half
swaths: warm is what no pass has treated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from shapely import MultiPolygon, Polygon

from oxbow.arrays import Place
from oxbow.mission.file import Mission
from oxbow.planning.field_names import FieldNames
from oxbow.site.site import Site
from oxbow_certificate.axes import Paths
from oxbow_certificate.certify import Judgement, judge
from oxbow_certificate.distance import PathDistance
from oxbow_cli import chart, sheet
from oxbow_cli.chart import GAP
from oxbow_cli.evaluation import certify_request
from oxbow_cli.lettering import lettering
from oxbow_cli.sheet import INK

__all__ = ["GAPS", "MOST_RADII", "Unit", "draw_gaps"]

MOST_RADII = 2.5
"""The scale's end, in units of `Unit`: the same in every picture, so that pictures can be compared."""

GAPS = LinearSegmentedColormap.from_list(
    "gaps",
    [
        (radii / MOST_RADII, colour)
        for radii, colour in (
            (0.0, "#f3f9fb"),
            (1.0, "#86bbd2"),
            (1.12, "#f5efcf"),
            (1.5, "#f3a950"),
            (2.0, "#c8322b"),
            (2.5, "#5c0c22"),
        )
    ],
)
"""Blue as far as the best possible path would be from its farthest water, and warm beyond."""

_PLACES = 250_000

_MAGNIFIED_IN = 2.0
_MAGNIFIED_RADII = 3.5
"""How much of the worst gap's surroundings is drawn magnified, in radii of the gap."""


@dataclass(frozen=True)
class Unit:
    """The unit in which distances are given: its length, and its name in the plural."""

    length_m: float
    name: str

    @classmethod
    def of(cls, mission: Mission, judgement: Judgement, *, treats: bool) -> Unit:
        """The least radius for a survey; half a swath for a treatment, where the least radius means nothing.

        Parameters
        ----------
        mission
            The mission.
        judgement
            Of its paths.
        treats
            Whether the paths treat hot spots.

        Returns
        -------
        Unit
            Its length in metres.
        """
        # A treatment has no best radius for its length: what it should keep to is its swath.
        if treats and mission.treated_swath_m is not None:
            return cls(mission.treated_swath_m / 2, "half swaths")
        return cls(judgement.certificate.least_radius_m, "least radii")


def draw_gaps(mission: Mission, path: Path, *, width_px: int = 2000) -> None:
    """Draw the distance of a mission's water to its paths to a PNG or SVG file, and its worst gap.

    The worst gap is drawn magnified beside the water, if there is room and it gets at least twice as large.

    Parameters
    ----------
    mission
        A Mission File with a path, whoever made it.
    path
        The picture's file, replaced as a whole; its suffix chooses the format.
    width_px
        Width of the picture; its height follows from the site.

    Raises
    ------
    InvalidMission
        There is no path, the suffix is neither of the two, the width is not positive, or the site is not valid.
    Infeasible
        The zones or the safety distance leave no water to judge on.
    """
    # Before the judgement, which takes seconds on a large lake.
    sheet.checked_format(path, width_px)
    site = Site.of(mission)
    request = certify_request(mission, site)
    with FieldNames.of_mission(mission, site).in_errors():
        judgement = judge(request)
    unit = Unit.of(mission, judgement, treats=bool(request.areas))
    figures = _treated_figures(judgement, unit) if request.areas else _figures(judgement)
    with lettering():
        # In the order in which things lie on top of one another; the magnified part avoids labels drawn before
        # it.
        figure, axes = sheet.new_sheet(site)
        chart.draw_site(axes, site, mission.safety_m)
        _draw_gaps(axes, judgement, unit)
        _note_worst_gap(axes, judgement, unit)
        chart.draw_ends(axes, site)
        sheet.draw_scale_and_north(axes)
        _draw_magnified(figure, axes, site, judgement, unit, mission.safety_m)
        _draw_key(figure, unit)
        sheet.draw_header(figure, f"Gaps of {mission.site_name or 'the path'}", figures)
        sheet.save_sheet(figure, path, width_px)


def _draw_gaps(axes: Axes, judgement: Judgement, unit: Unit) -> None:
    """The distance, the paths, and the disc that the worst gap would hold."""
    _draw_distance(axes, judgement.space.judged, judgement.paths, unit)
    width = 0.6 * chart.line_width(axes, 2.0 * unit.length_m)
    paths = [shapely.get_coordinates(path) for path in shapely.get_parts(judgement.paths)]
    lines = LineCollection(paths, colors=INK, linewidths=width, alpha=0.75, zorder=4)
    axes.add_collection(lines, autolim=False)
    chart.draw_disc(axes, judgement.cover.place, judgement.cover.low_m)


def _note_worst_gap(axes: Axes, judgement: Judgement, unit: Unit) -> None:
    (x, y), radius_m = judgement.cover.place, judgement.cover.low_m
    text = f"worst gap {sheet.distance_text(radius_m)}, {radius_m / unit.length_m:.2f} {unit.name}"
    chart.note(axes, (x, y + radius_m), text, colour=GAP)


def _draw_magnified(
    figure: Figure, axes: Axes, site: Site, judgement: Judgement, unit: Unit, safety_m: float
) -> None:
    """Draw the worst gap and the legs about it beside the water; nothing if there is no room."""
    x, y = judgement.cover.place
    shown_m = _MAGNIFIED_RADII * judgement.cover.low_m
    side_m = _MAGNIFIED_IN * (axes.get_xlim()[1] - axes.get_xlim()[0]) / figure.get_figwidth()
    times = side_m / (2 * shown_m)
    frame = _free_square(axes, site, judgement.cover.place, side_m)
    # Less than twice as large would show nothing that the map itself does not.
    if frame is None or times < 2.0:
        return
    corner = figure.transFigure.inverted().transform(axes.transData.transform(frame.bounds[:2]))
    size = _MAGNIFIED_IN / figure.get_figwidth(), _MAGNIFIED_IN / figure.get_figheight()
    inset = figure.add_axes((*corner, *size), facecolor=sheet.LAND, xticks=[], yticks=[])
    inset.set(xlim=(x - shown_m, x + shown_m), ylim=(y - shown_m, y + shown_m))
    chart.draw_site(inset, site, safety_m)
    _draw_gaps(inset, judgement, unit)
    inset.spines[:].set(color=GAP, zorder=9)
    inset.set_title(f"the worst gap, {times:.2g} times larger", fontsize=8, color=GAP, loc="left", pad=4)


def _free_square(axes: Axes, site: Site, place: Place, side_m: float) -> Polygon | None:
    """The square of a side nearest to a place, of those that meet neither the water, a label nor the map's rim."""
    (west, east), (south, north) = axes.get_xlim(), axes.get_ylim()
    rim_m = 0.015 * (east - west)
    # A coarse grid of corners is enough: the picture need not be as near to its place as it could be.
    corners_x = np.linspace(west + rim_m, east - 4 * rim_m - side_m, 24)
    corners_y = np.linspace(south + rim_m, north - rim_m - side_m, 24)
    x, y = (axis.ravel() for axis in np.meshgrid(corners_x, corners_y))
    squares = shapely.box(x, y, x + side_m, y + side_m)
    ends = shapely.MultiPoint([site.launch, site.recovery]).buffer(4 * rim_m)
    occupied = shapely.union_all([site.outline, ends, chart.labelled_area(axes)]).buffer(rim_m)
    free = squares[~shapely.intersects(occupied, squares)]
    return min(free, key=shapely.Point(place).distance, default=None)


def _draw_distance(axes: Axes, region: MultiPolygon, paths: Paths, unit: Unit) -> None:
    """The distance on a grid, clipped to the region."""
    (west, east), (south, north) = axes.get_xlim(), axes.get_ylim()
    pixel_m = (east - west) / 2000
    # The magnified picture shows a small part of the region, which alone is computed, as finely as it is drawn.
    seen = shapely.clip_by_rect(region, west, south, east, north)
    west, south, east, north = seen.bounds
    step_m = max(math.sqrt(seen.area / _PLACES), pixel_m)
    x = np.arange(west - step_m, east + 2 * step_m, step_m)
    y = np.arange(south - step_m, north + 2 * step_m, step_m)
    places = np.stack(np.meshgrid(x, y), axis=-1)
    # Two steps beyond the region, so that its border is coloured to the edge.
    near = seen.buffer(2 * step_m)
    shapely.prepare(near)
    wanted = shapely.contains_xy(near, places[..., 0], places[..., 1])
    distance = np.full(wanted.shape, np.nan)
    distance[wanted] = PathDistance(paths, unit.length_m)(places[wanted]) / unit.length_m
    # A raster: between thousands of legs the distance has more ridges than contour lines could show.
    image = axes.imshow(
        distance,
        extent=(x[0] - step_m / 2, x[-1] + step_m / 2, y[0] - step_m / 2, y[-1] + step_m / 2),
        origin="lower",
        cmap=GAPS,
        vmin=0.0,
        vmax=MOST_RADII,
        interpolation="bilinear",
        aspect="auto",
        zorder=3.5,
    )
    clip = chart.patch(seen, facecolor="none", edgecolor="none")
    axes.add_patch(clip)
    image.set_clip_path(clip)


def _draw_key(figure: Figure, unit: Unit) -> None:
    key = sheet.add_key(figure, 0.5, 0.44, GAPS)
    for units in np.arange(0.0, MOST_RADII + 0.5, 0.5):
        text = f"{units:g}" if units < MOST_RADII else f"{units:g} and more"
        key.text(units / MOST_RADII, -0.6, text, ha="center", va="top", fontsize=8, color=INK)
    text = f"distance to the path, in {unit.name} of {sheet.distance_text(unit.length_m)}"
    key.text(0.0, 1.5, text, ha="left", va="bottom", fontsize=8, color=INK)


def _figures(judgement: Judgement) -> str:
    """The line below the title: how much of the water is within the least radius, and how far the rest is."""
    measures = judgement.certificate
    within = np.mean(judgement.spread.distance_m <= measures.least_radius_m)
    return (
        f"{within:.0%} of the water within the least radius of the path   q {measures.q:.2f}"
        f"   p95 {measures.p95_ratio:.2f}   p99 {measures.p99_ratio:.2f}   mean {measures.mean_ratio:.2f}"
    )


def _treated_figures(judgement: Judgement, unit: Unit) -> str:
    """The same of a treatment: how much of the hot spots that the paths come to is treated."""
    within = np.mean(judgement.spread.distance_m <= unit.length_m)
    return f"{within:.1%} of the hot spots that are visited within half a swath of the path"
