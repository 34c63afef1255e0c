"""A picture of a completed Mission File: the water, what paths must avoid, hot spots, and the paths.

A single path is coloured by its progress, so that its direction can be followed; the paths of several vehicles
have one colour each. Marks show the ends of the paths, the widest gap of a survey, water that the plan leaves out,
and hot spots that it does not treat.
"""

from __future__ import annotations

import math
from itertools import cycle, pairwise
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from oxbow.arrays import FloatArray
from oxbow.geometry.frame import lonlat
from oxbow.mission.file import Mission
from oxbow.mission.plan import PlanRecord, TreatmentRecord
from oxbow.site.site import Site
from oxbow_cli import chart, sheet
from oxbow_cli.chart import GAP
from oxbow_cli.lettering import lettering
from oxbow_cli.sheet import INK

__all__ = ["draw"]

PROGRESS = "viridis"
_COLOURS = 256
FLEET = ("#2166ac", "#d6604d", "#1b7837", "#762a83", "#b35806", "#01665e", "#c51b7d", "#4d4d4d")
"""Colours of the vehicles of a fleet, in turn."""
_KEY_ROWS = 3
SPOT = "#f6c1b5"
DANGER = "#d9822b"


def draw(mission: Mission, path: Path, *, width_px: int = 2000) -> None:
    """Draw a mission to a PNG or SVG file; without a path, the site alone is drawn, and the picture says so.

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
        The suffix is neither of the two, the width is not positive, or the site is not valid.
    """
    sheet.checked_format(path, width_px)
    with lettering():
        _draw(mission, Site.of(mission), path, width_px)


def _draw(mission: Mission, site: Site, path: Path, width_px: int) -> None:
    figure, axes = sheet.new_sheet(site)
    chart.draw_site(axes, site, mission.safety_m)
    for spot in site.hot_spots:
        axes.add_patch(chart.patch(spot.area, facecolor=SPOT, edgecolor=GAP, linewidth=0.7, alpha=0.7, zorder=3))
    _draw_danger(axes, site)
    paths = [site.frame.to_planar(lonlat(planned.path)) for planned in mission.planned_paths]
    if len(paths) == 1:
        _draw_path(axes, paths[0], site.nominal_spacing_m)
        _draw_progress_key(figure)
    elif paths:
        _draw_fleet(axes, paths, min(site.nominal_spacing_m, mission.treated_swath_m or math.inf))
        _draw_names_key(figure, [planned.name for planned in mission.planned_paths])
    _draw_findings(axes, mission, site)
    chart.draw_ends(axes, site)
    sheet.draw_scale_and_north(axes)
    sheet.draw_header(figure, mission.site_name or "Survey mission", _figures(mission, site))
    sheet.save_sheet(figure, path, width_px)


def _draw_danger(axes: Axes, site: Site) -> None:
    """Draw the parts of danger zones in the water, hatched, with their names and dangers."""
    style = {"facecolor": "none", "edgecolor": DANGER, "hatch": r"\\\\", "linewidth": 0.8, "zorder": 3.5}
    for zone in site.danger_zones:
        water = zone.area.intersection(site.outline)
        axes.add_patch(chart.patch(water, **style))
        # Not the centroid, which may lie on land where the zone is bent.
        place = water.representative_point()
        text = f"{zone.name}: danger {zone.probability:g} per {zone.per}"
        chart.note(axes, (place.x, place.y), text, colour=DANGER)


def _draw_path(axes: Axes, xy: FloatArray, spacing_m: float) -> None:
    """Draw the path in pieces of equal length, each of one colour, thin enough to keep its legs apart."""
    axes.add_collection(
        LineCollection(
            _pieces(xy),
            cmap=PROGRESS,
            array=np.linspace(0, 1, _COLOURS),
            linewidths=chart.line_width(axes, spacing_m),
            capstyle="round",
            joinstyle="round",
            zorder=4,
        ),
        autolim=False,
    )


def _draw_fleet(axes: Axes, paths: list[FloatArray], spacing_m: float) -> None:
    """Draw the path of each vehicle in its own colour, thin enough to keep legs of the least spacing apart."""
    for xy, colour in zip(paths, cycle(FLEET)):
        axes.plot(*xy.T, color=colour, linewidth=chart.line_width(axes, spacing_m), zorder=4)
    axes.autoscale(False)


def _pieces(xy: FloatArray) -> list[FloatArray]:
    """A path cut into pieces of equal length."""
    at = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])
    cuts = np.linspace(0.0, at[-1], _COLOURS + 1)
    ends = np.column_stack([np.interp(cuts, at, xy[:, axis]) for axis in (0, 1)])
    # Each piece has its two interpolated ends, and the vertices strictly between: neighbours share an end
    # exactly.
    first = np.searchsorted(at, cuts, side="right")
    return [
        np.vstack([ends[k], xy[start : max(start, np.searchsorted(at, cuts[k + 1]))], ends[k + 1]])
        for k, (start, _) in enumerate(pairwise(first))
    ]


def _draw_findings(axes: Axes, mission: Mission, site: Site) -> None:
    """Draw what the plan leaves out, and the disc that fits in a survey's widest gap."""
    if mission.plan is None:
        return
    for part in mission.plan.dropped:
        place = site.frame.to_planar(lonlat([part.place]))[0]
        axes.plot(*place, marker="x", markersize=7, markeredgewidth=1.8, color=GAP, zorder=6)
        chart.note(axes, (place[0], place[1]), f"dropped {sheet.area_text(part.area_m2)}", colour=GAP)
    untreated = _untreated(mission.plan.treatment)
    for spot in (spot for spot in site.hot_spots if spot.name in untreated):
        place = spot.area.representative_point()
        chart.note(axes, (place.x, place.y), f"{spot.name}: not treated", colour=GAP)
    certificate = mission.plan.certificate
    # A treatment has no such gap: every pass leaves half a swath on either side.
    if certificate.worst_gap is not None and not site.teams[0].treats:
        x, y = site.frame.to_planar(lonlat([certificate.worst_gap]))[0]
        radius_m = certificate.cover_radius_m[0]
        chart.draw_disc(axes, (x, y), radius_m)
        chart.note(axes, (x, y + radius_m), f"widest gap {sheet.distance_text(radius_m)}", colour=GAP)


def _draw_progress_key(figure: Figure) -> None:
    key = sheet.add_key(figure, 0.74, 0.14, PROGRESS)
    for x, text, side in ((-0.04, "start", "right"), (1.04, "end", "left")):
        key.text(x, 0.5, text, transform=key.transAxes, ha=side, va="center", fontsize=8, color=INK)


def _draw_names_key(figure: Figure, names: list[str]) -> None:
    """Draw the key of the vehicles' colours in the footer, where it hides no water."""
    lines = [Line2D([], [], color=colour) for _, colour in zip(names, cycle(FLEET))]
    key = figure.legend(
        lines,
        [""] * len(names),
        loc="lower right",
        bbox_to_anchor=(0.97, 0.1 / figure.get_figheight()),
        ncols=math.ceil(len(names) / _KEY_ROWS),
        frameon=False,
        fontsize=8,
        labelcolor=INK,
        handlelength=1.5,
        labelspacing=0.3,
    )
    for text, name in zip(key.get_texts(), names, strict=True):
        # A name with two dollar signs would be set as a formula, or raise an error; the legend offers no other
        # way.
        text.set_parse_math(False)
        text.set_text(name)


def _figures(mission: Mission, site: Site) -> str:
    """The line below the title: what is planned, how densely, and how near it is to the best possible."""
    if not mission.planned_paths:
        return "no path yet: the site alone"
    if mission.plan is None:
        return "a path without a record of its planning"
    plan = mission.plan
    dropped = f"   dropped {sheet.area_text(sum(part.area_m2 for part in plan.dropped))}" if plan.dropped else ""
    treated = "" if plan.treatment is None else f"   {_treated(plan.treatment)}"
    if site.teams[0].treats:
        return f"{_paths_text(plan)}{treated}"
    return (
        f"{plan.method} {_paths_text(plan)}   spacing {sheet.distance_text(plan.spacing_m)}"
        f"   q {plan.certificate.q:.2f}   p95 {plan.certificate.p95_ratio:.2f}{treated}{dropped}"
    )


def _paths_text(plan: PlanRecord) -> str:
    """The number of paths, those of slaves included, and their total length."""
    lengths_m = [plan.length_m] if plan.fleet is None else [vehicle.length_m for vehicle in plan.fleet.vehicles]
    paths = f"{len(lengths_m)} paths" if len(lengths_m) > 1 else "path"
    return f"{paths} {sheet.distance_text(sum(lengths_m))}"


def _treated(treatment: TreatmentRecord) -> str:
    count = len(treatment.hot_spots)
    return f"{count - len(_untreated(treatment))} of {count} hot spots treated"


def _untreated(treatment: TreatmentRecord | None) -> set[str]:
    """The names of the hot spots of which no part is treated."""
    spots = () if treatment is None else treatment.hot_spots
    return {spot.hot_spot for spot in spots if spot.treated_share == 0.0}
