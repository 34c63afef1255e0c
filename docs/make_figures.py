"""Draw the figures of these documents: an example mission as its stages show it, and plans good and bad.

``python docs/make_figures.py`` writes `plan.png`, `stages.png`, `quality.png`, `gaps.png`, `plans.png` and
`fleet.png` in `docs/images`; `docs/recording.md` says how `recording.png` is made.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path as Outline
from sample_plans import SQUARE, sample_plans
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.contracts import Certificate, CertifyRequest, CriticalKind
from oxbow.mission.file import Mission, read_mission
from oxbow.planning.pipeline import plan_mission
from oxbow.wire.recording import Layer
from oxbow_certificate.certify import certify
from oxbow_certificate.distance import PathDistance
from oxbow_cli.gaps import GAPS, MOST_RADII, draw_gaps
from oxbow_cli.local import local_call
from oxbow_cli.picture import draw

FOLDER = Path(__file__).parent
LAND, WATER, SHORE, INK = "#f4f0e6", "#d3e6ef", "#7d8f96", "#24343b"
ARROW = {"arrowstyle": "-", "color": SHORE, "linewidth": 0.6}
KIND_MARKERS = {
    CriticalKind.OPEN: (">", "#1b7837"),
    CriticalKind.CLOSE: ("<", "#762a83"),
    CriticalKind.SPLIT: ("s", "#d6604d"),
    CriticalKind.MERGE: ("D", "#2166ac"),
}

Layers = dict[tuple[str, str], Layer]


def main() -> None:
    """Plan the example once, and draw all figures."""
    mission = read_mission(FOLDER / "examples" / "lake.json")
    layers: Layers = {}

    def keep(layer: Layer) -> None:
        layers[layer.stage, layer.name] = layer

    planned = plan_mission(mission, call=local_call(keep))
    draw(planned, FOLDER / "images" / "plan.png", width_px=1200)
    draw_stages(layers, FOLDER / "images" / "stages.png")
    draw_quality(layers, planned, FOLDER / "images" / "quality.png")
    draw_gaps(planned, FOLDER / "images" / "gaps.png", width_px=840)
    draw_plans(FOLDER / "images" / "plans.png")
    fleet = plan_mission(read_mission(FOLDER / "examples" / "fleet.json"), call=local_call())
    draw(fleet, FOLDER / "images" / "fleet.png", width_px=1200)


def draw_stages(layers: Layers, file: Path) -> None:
    """Free space, cells and critical points, the tree and its region, the path."""
    figure, panels = _sheet(layers, 2, 2)
    free = layers["contour", "eroded"].geometries[0]
    path = layers["path", "path"].geometries[0]

    _titled(panels[0], "contour: simplified, eroded by the safety distance")
    _draw_water(panels[0], layers)
    _draw_polygons(panels[0], [free], facecolor=WATER, edgecolor=INK, linewidth=0.6)

    _titled(panels[1], "decomposition: cells and critical points")
    _draw_cells(panels[1], layers)

    _titled(panels[2], "path: the walk round a tree, which the curve starts from")
    _draw_polygons(panels[2], [free], facecolor=WATER, edgecolor=SHORE, linewidth=0.5)
    start = layers["path", "start"].geometries[0]
    _draw_polygons(panels[2], [Polygon(start)], facecolor="#f6c65b", edgecolor=INK, linewidth=0.8)
    _draw_lines(panels[2], layers["path", "circuit"].geometries, color="#c8322b", linewidths=0.8)

    _titled(panels[3], "path: the curve, folded into the water and refined")
    _draw_polygons(panels[3], [free], facecolor=WATER, edgecolor=SHORE, linewidth=0.5)
    _draw_lines(panels[3], [path], color=INK, linewidths=0.8)
    panels[3].plot(*path.coords[0], marker="o", color="white", markeredgecolor=INK, markersize=5)
    figure.savefig(file, dpi=110)


def draw_quality(layers: Layers, planned: Mission, file: Path) -> None:
    """Distance to the path all over the free space, its spread, and the place of the cover radius."""
    assert planned.plan is not None
    certificate = planned.plan.certificate
    free, path = layers["contour", "eroded"].geometries[0], layers["certificate", "path"].geometries[0]
    figure = Figure(figsize=(10.0, 4.6), layout="constrained")
    field, spread = figure.subplots(1, 2, width_ratios=[1.45, 1.0])

    west, south, east, north = free.bounds
    step_m = (east - west) / 500
    x, y = np.meshgrid(np.arange(west, east, step_m), np.arange(south, north, step_m))
    inside = shapely.contains_xy(free, x, y)
    ratio = np.full(x.shape, np.nan)
    distances = (
        PathDistance(path, certificate.least_radius_m)(np.column_stack([x[inside], y[inside]]))
        / certificate.least_radius_m
    )
    ratio[inside] = distances
    image = field.imshow(ratio, extent=(west, east, south, north), origin="lower", cmap="YlOrRd", vmin=0.0)
    _draw_lines(field, [path], color=INK, linewidths=0.5)
    worst = layers["certificate", "worst_gap"].geometries[0].coords[0]
    radius_m = certificate.cover_radius_m[0]
    field.add_patch(Circle(worst, radius_m, facecolor="none", edgecolor="#2166ac", linewidth=1.4))
    field.set_axis_off()
    figure.colorbar(image, ax=field, label="distance to the path / least radius", shrink=0.8)

    ranked = np.sort(distances)
    spread.plot(ranked, np.linspace(0.0, 1.0, len(ranked)), color=INK)
    marks = {"mean": certificate.mean_ratio / 2, "p95": certificate.p95_ratio, "q": certificate.q}
    for (name, value), share in zip(marks.items(), (0.45, 0.6, 0.75), strict=True):
        spread.axvline(value, color="#2166ac", linewidth=0.8, linestyle="--")
        spread.text(value + 0.03, share, name, color="#2166ac", ha="left")
    # The places within r of a path of length L fill at most 2 r L + pi r^2.
    r_m = np.linspace(0.0, certificate.least_radius_m, 50)
    most = (2 * certificate.length_m + np.pi * r_m) * r_m / certificate.free_area_m2
    spread.plot(r_m / certificate.least_radius_m, most, color=SHORE, linewidth=1.0)
    spread.annotate(
        "no path of this length\ncan be above this",
        (r_m[40] / certificate.least_radius_m, most[40]),
        (0.97, 0.08),
        textcoords="axes fraction",
        ha="right",
        color=SHORE,
        arrowprops=ARROW,
    )
    spread.set(xlabel="distance to the path / least radius", ylabel="share of the free space nearer than that")
    spread.set(xlim=(0.0, 1.15 * certificate.q), ylim=(0.0, 1.02))
    figure.savefig(file, dpi=110)


def draw_plans(file: Path) -> None:
    """Paths of one length over one square: their gaps and their measures."""
    figure = Figure(figsize=(9.6, 7.9), layout="constrained")
    for axes, (name, path) in zip(figure.subplots(2, 3).flat, sample_plans().items(), strict=True):
        ends = path.coords[0], path.coords[-1]
        measures = certify(CertifyRequest(outline=SQUARE, path=path, launch=ends[0], recovery=ends[1]))
        west, south, east, north = SQUARE.bounds
        x, y = np.meshgrid(np.linspace(west, east, 160), np.linspace(south, north, 160))
        radii = (
            PathDistance(path, measures.least_radius_m)(np.column_stack([x.ravel(), y.ravel()]))
            / measures.least_radius_m
        )
        extent = (west, east, south, north)
        axes.imshow(radii.reshape(x.shape), extent=extent, origin="lower", cmap=GAPS, vmin=0.0, vmax=MOST_RADII)
        _draw_lines(axes, [path], color=INK, linewidths=0.7)
        axes.set_title(name, fontsize=11, color=INK, weight="bold")
        axes.set_xlabel(_caption(measures), fontsize=9, color=INK)
        axes.set(xticks=[], yticks=[])
        axes.spines[:].set_color(SHORE)
    figure.savefig(file, dpi=95)


def _caption(measures: Certificate) -> str:
    """How the sample plans differ."""
    simple = "" if measures.is_simple else f", {measures.crossings} crossings"
    return (
        f"q {measures.q:.2f}   p95 {measures.p95_ratio:.2f}   mean {measures.mean_ratio:.2f}{simple}\n"
        f"least leg distance {measures.least_leg_distance_m:.0f} m   {measures.turns} turns\n"
        f"discrepancy ratio {measures.discrepancy_ratio:.2f}   evenness {measures.directional_evenness:.2f}"
    )


def _draw_cells(axes: Axes, layers: Layers) -> None:
    cells = layers["decomposition", "cells"].geometries
    wide = [cell for cell in cells if not cell.is_empty]
    _draw_polygons(axes, wide, facecolor=WATER, edgecolor=SHORE, linewidth=0.4)
    points = layers["decomposition", "critical_points"]
    for kind, (marker, colour) in KIND_MARKERS.items():
        places = [
            point.coords[0]
            for point, label in zip(points.geometries, points.labels, strict=True)
            if label == kind.value
        ]
        axes.scatter(*np.array(places).T, marker=marker, s=11, color=colour, label=kind.value, zorder=3)
    axes.legend(loc="lower left", frameon=False, fontsize=8, handletextpad=0.1)


def _draw_water(axes: Axes, layers: Layers) -> None:
    outline, *zones = layers["contour", "raw"].geometries
    water = outline.difference(shapely.union_all(zones))
    parts = [part for part in shapely.get_parts(water) if isinstance(part, Polygon)]
    _draw_polygons(axes, parts, facecolor="white", edgecolor=SHORE, linewidth=0.5)


def _sheet(layers: Layers, rows: int, columns: int) -> tuple[Figure, list[Axes]]:
    west, south, east, north = layers["contour", "raw"].geometries[0].bounds
    width_in = 5.2
    height_in = width_in * (north - south) / (east - west) + 0.35
    figure = Figure(figsize=(columns * width_in, rows * height_in), layout="constrained")
    panels = list(figure.subplots(rows, columns, sharex=True, sharey=True).flat)
    for axes in panels:
        axes.set_aspect("equal")
        axes.set_axis_off()
    return figure, panels


def _titled(axes: Axes, title: str) -> None:
    axes.set_title(title, fontsize=9, color=INK)


def _draw_polygons(axes: Axes, polygons: list[Polygon], **style: object) -> None:
    for polygon in polygons:
        rings = [Outline(shapely.get_coordinates(ring), closed=True) for ring in shapely.get_rings(polygon)]
        axes.add_patch(PathPatch(Outline.make_compound_path(*rings), **style))
    axes.autoscale_view()


def _draw_lines(axes: Axes, lines: tuple[BaseGeometry, ...] | list[BaseGeometry], **style: object) -> None:
    axes.add_collection(LineCollection([shapely.get_coordinates(line) for line in lines], **style))


if __name__ == "__main__":
    main()
