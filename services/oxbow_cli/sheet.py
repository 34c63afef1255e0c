"""The sheet that a mission is drawn on: its size, scale, header and key, and the file."""

from __future__ import annotations

import io
import math
from pathlib import Path

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from matplotlib.patches import Polygon as PolygonPatch
from matplotlib.text import Text

from oxbow.errors import InvalidOption
from oxbow.mission.files import write_atomically
from oxbow.site.site import Site
from oxbow_cli.interrupts import ending

__all__ = [
    "INK",
    "LAND",
    "add_key",
    "area_text",
    "checked_format",
    "distance_text",
    "draw_header",
    "draw_scale_and_north",
    "new_sheet",
    "save_sheet",
]

FORMATS = {".png": "png", ".svg": "svg"}

LAND, INK = "#f4f0e6", "#24343b"

_DPI = 200
_HEADER_IN, _FOOTER_IN = 0.85, 0.75
_HEADER_END = 0.94
"""Where the north arrow begins, as a fraction of the sheet's width."""
_SMALLEST_PT = 8.0
_MOST_CHARACTERS = 400


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
