"""The sheet for pictures of a mission: map, land and water, scale, header, and the file."""

from __future__ import annotations

import io
import logging
import math
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import shapely
from matplotlib import font_manager, patheffects, rc_context, rcParams
from matplotlib.axes import Axes
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from matplotlib.patches import Circle, PathPatch
from matplotlib.patches import Polygon as PolygonPatch
from matplotlib.path import Path as Outline
from matplotlib.text import Text
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import Place
from oxbow.errors import InvalidMission, InvalidOption
from oxbow.mission.files import write_atomically
from oxbow.site.site import Site
from oxbow_certificate.erosion import eroded_water
from oxbow_cli.interrupts import ending

__all__ = [
    "GAP",
    "INK",
    "LAND",
    "WATER",
    "add_key",
    "area_text",
    "checked_format",
    "distance_text",
    "draw_disc",
    "draw_ends",
    "draw_header",
    "draw_scale_and_north",
    "draw_site",
    "labelled_area",
    "lettering",
    "line_width",
    "new_sheet",
    "note",
    "patch",
    "save_sheet",
]

FORMATS = {".png": "png", ".svg": "svg"}

LAND, WATER, MARGIN, SHORE, INK = "#f4f0e6", "#d3e6ef", "#e6f0f3", "#7d8f96", "#24343b"
FORBIDDEN, FORBIDDEN_EDGE, GAP = "#e8d8c3", "#b5805a", "#c8322b"
_DPI = 200
_HEADER_IN, _FOOTER_IN = 0.85, 0.75
_TOGETHER_M = 1.0
"""Ends of paths nearer to each other than this are drawn as one."""
_HEADER_END = 0.94
"""Where the north arrow begins, as a fraction of the sheet's width."""
_SMALLEST_PT = 8.0
_MOST_CHARACTERS = 400
_FALLBACK_FONTS = (
    "Noto Sans",
    "Noto Sans CJK SC",
    "Noto Sans CJK JP",
    "Noto Sans Arabic",
    "Noto Sans Devanagari",
    "Droid Sans Fallback",
    "WenQuanYi Zen Hei",
    "Microsoft YaHei",
    "Hiragino Sans",
    "Arial Unicode MS",
)
_MISSING_GLYPH = re.compile(r"Glyph (\d+) .* missing from ")
_log = logging.getLogger(__name__)
_HALO = [patheffects.withStroke(linewidth=2.5, foreground="white")]


def checked_format(path: Path, width_px: int) -> str:
    """The format that a picture's name asks for.

    Parameters
    ----------
    path
        The picture's file.
    width_px
        Its width, >= 1.

    Returns
    -------
    str
        As matplotlib calls it: ``png`` or ``svg``.

    Raises
    ------
    InvalidOption
        The suffix is neither .png nor .svg, or the width is not positive.
    """
    if path.suffix.lower() not in FORMATS:
        raise InvalidOption(f"is {str(path)!r}; expected a name that ends in .png or .svg", where="--output")
    if width_px < 1:
        raise InvalidOption(f"is {width_px}; expected a width of at least 1 pixel", where="width_px")
    return FORMATS[path.suffix.lower()]


def save_sheet(figure: Figure, path: Path, width_px: int) -> None:
    """Write a sheet to its file, as a whole.

    Parameters
    ----------
    figure
        The sheet.
    path
        The file; its suffix chooses the format.
    width_px
        Width of the picture, in pixels.
    """
    kind = checked_format(path, width_px)
    # Drawn in memory first: a picture that fails half way leaves the old file as it was.
    picture = io.BytesIO()
    # Without a date, the same mission gives the same file.
    metadata = {"Date": None} if kind == "svg" else {}
    figure.savefig(picture, format=kind, dpi=_DPI * width_px / 2000, metadata=metadata)
    with ending.holding_signals():
        write_atomically(path, picture.getvalue())


def new_sheet(site: Site) -> tuple[Figure, Axes]:
    """A sheet of fixed width in inches, as tall as the site needs, and the map's axes in metres."""
    west, south, east, north = shapely.union_all(
        [site.outline, shapely.Point(site.launch), shapely.Point(site.recovery)]
    ).bounds
    margin = 0.04 * max(east - west, north - south)
    width_m, height_m = east - west + 2 * margin, north - south + 2 * margin
    width_in = 2000 / _DPI
    # Bounded: a river of 20 km by 200 m would give a strip, or a sheet that no screen shows.
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


def draw_scale_and_north(axes: Axes) -> None:
    """Draw a scale bar of a round length below the map, and a north arrow above it."""
    (west, east), (south, north) = axes.get_xlim(), axes.get_ylim()
    # The bar, a fifth of the map's width at most, in four parts of alternating colour.
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
    axes.text(x + bar_m + 0.01 * (east - west), y, distance_text(bar_m), fontsize=8, color=INK, va="baseline")
    # The arrow keeps its size in inches, however large the map is.
    height_in = axes.figure.get_window_extent().height / axes.figure.dpi
    axes.annotate(
        "N",
        xy=(0.965, 1 - 0.2 / height_in),
        xytext=(0.965, 1 - 0.75 / height_in),
        xycoords="figure fraction",
        ha="center",
        va="center",
        color=INK,
        fontsize=10,
        arrowprops={"arrowstyle": "-|>", "color": INK, "linewidth": 1.4},
    )


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


def _map_height_in(axes: Axes) -> float:
    return float(axes.get_position().height * axes.figure.get_window_extent().height / axes.figure.dpi)


def add_key(figure: Figure, left: float, width: float, cmap: str | Colormap) -> Axes:
    """Draw a strip of a colour map in the sheet's footer.

    Parameters
    ----------
    figure
        The sheet.
    left, width
        Where the strip lies, as fractions of the sheet's width.
    cmap
        The colour map.

    Returns
    -------
    Axes
        Of the strip, from 0 to 1 along x and y.
    """
    height_in = figure.get_figheight()
    key = figure.add_axes((left, 0.36 / height_in, width, 0.1 / height_in))
    key.imshow(np.linspace(0, 1, 256)[None, :], aspect="auto", cmap=cmap, extent=(0, 1, 0, 1))
    key.set_axis_off()
    return key


def draw_header(figure: Figure, title: str, figures: str) -> None:
    """Write a title, and a line of figures below it; text that is too long is made smaller, then cut.

    Parameters
    ----------
    figure
        The sheet.
    title
        The site's name, say; of any length.
    figures
        One line.
    """
    top = 1 - 0.38 / figure.get_figheight()
    title = " ".join(title.split())
    named = figure.text(0.04, top, title, fontsize=15, weight="bold", color=INK, parse_math=False)
    below = top - 0.27 / figure.get_figheight()
    told = figure.text(0.04, below, figures, fontsize=9.5, color=INK, parse_math=False)
    for text in (named, told):
        _fit(figure, text)


def _fit(figure: Figure, text: Text) -> None:
    """Keep a line of the header clear of the north arrow."""
    room = (_HEADER_END - text.get_position()[0]) * figure.get_window_extent().width
    whole, shown = text.get_text(), _MOST_CHARACTERS
    if len(whole) > shown:
        text.set_text(f"{whole[:shown]}…")
    if (width := text.get_window_extent().width) > room:
        text.set_fontsize(max(float(text.get_fontsize()) * room / width, _SMALLEST_PT))
    # Measured after each cut, since characters differ in width.
    while (width := text.get_window_extent().width) > room and shown > 1:
        shown = max(1, int(min(shown, len(text.get_text()) - 1) * room / width))
        text.set_text(f"{whole[:shown].rstrip()}…")


@contextmanager
def lettering() -> Iterator[None]:
    """Within this context, text is drawn in fonts that have its characters; a note names those without any."""
    installed = set(font_manager.get_font_names())
    families = [*rcParams["font.sans-serif"][:1], *(name for name in _FALLBACK_FONTS if name in installed)]
    with warnings.catch_warnings(record=True) as caught, rc_context({"font.family": families}):
        warnings.simplefilter("always")
        yield
    missing = set()
    for warning in caught:
        if match := _MISSING_GLYPH.match(str(warning.message)):
            missing.add(chr(int(match[1])))
        else:
            warnings.warn_explicit(warning.message, warning.category, warning.filename, warning.lineno)
    if missing:
        _log.warning("note: no installed font has %s: drawn as boxes", "".join(sorted(missing)))


def _round_down(length_m: float) -> float:
    """The longest of 1, 2 and 5 times a power of ten that is not above a length."""
    power = 10.0 ** math.floor(math.log10(length_m))
    return max(step * power for step in (1, 2, 5) if step * power <= length_m)


def distance_text(length_m: float) -> str:
    """A length for readers, in kilometres or metres."""
    return f"{length_m / 1000:,.4g} km" if length_m >= 1000 else f"{length_m:.3g} m"


def area_text(area_m2: float) -> str:
    """An area for readers, in square kilometres or metres."""
    return f"{area_m2 / 1e6:.3g} km²" if area_m2 >= 1e4 else f"{area_m2:.3g} m²"
