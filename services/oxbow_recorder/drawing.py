"""How a layer becomes rerun archetypes: flat for the stage's own tab, and on the map.

rerun's flat views have y downwards, so that northings are negated in them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import rerun as rr
import shapely
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray
from oxbow.geometry.frame import Frame
from oxbow.wire.recording import Colour, Layer, LayerKind

__all__ = ["Drawn", "draw"]

PALETTE: dict[tuple[str, str], Colour] = {
    ("mission", "site"): (120, 144, 156),
    ("contour", "raw"): (120, 144, 156),
    ("contour", "simplified"): (255, 179, 0),
    ("contour", "eroded"): (38, 166, 154),
    ("contour", "dropped"): (229, 57, 53),
    ("assignment", "mesh"): (55, 71, 79),
    ("assignment", "hot_spots"): (236, 64, 122),
    ("assignment", "passes"): (144, 164, 174),
    ("assignment", "routes"): (100, 181, 246),
    ("assignment", "routes_visibility"): (100, 181, 246),
    ("assignment", "routes_tessellation"): (255, 213, 79),
    ("assignment", "routes_funnel"): (240, 98, 146),
    ("assignment", "routes_incenters"): (102, 187, 106),
    ("assignment", "further"): (186, 104, 200),
    ("decomposition", "cells"): (100, 181, 246),
    ("decomposition", "critical_points"): (255, 112, 67),
    ("path", "iterations"): (186, 104, 200),
    ("path", "start"): (144, 164, 174),
    ("path", "ring"): (186, 104, 200),
    ("path", "refined"): (38, 166, 154),
    ("path", "contours"): (144, 164, 174),
    ("path", "links"): (255, 179, 0),
    ("path", "sites"): (236, 64, 122),
    ("path", "tour"): (144, 164, 174),
    ("path", "transects"): (144, 164, 174),
    ("path", "circuit"): (255, 179, 0),
    ("path", "cuts"): (236, 64, 122),
    ("path", "path"): (66, 165, 245),
}
OTHER: Colour = (176, 190, 197)
TEAM: tuple[Colour, ...] = (
    (66, 165, 245),
    (255, 112, 67),
    (102, 187, 106),
    (186, 104, 200),
    (255, 213, 79),
    (38, 198, 218),
    (240, 98, 146),
    (176, 190, 197),
)
"""Colours that distinguish vehicles, or kinds of a graph's nodes, in turn."""
BY_VEHICLE = frozenset({("assignment", "shares"), ("assignment", "sorties"), ("certificate", "path")})
"""Layers that have one geometry per vehicle, all in the same order: share or sortie, and path."""
NEAR, FAR = np.array([38, 166, 154]), np.array([229, 57, 53])
"""Ends of the scale for values from 0 to 1."""

MOST_LABELS = 40
"""More labels than these are kept, but not shown at once."""

NODE_APART = 120.0
"""About how far apart a graph's nodes are drawn, in units of the screen: their labels need that."""

ON_MAP = frozenset(
    {("mission", "site"), ("contour", "eroded"), ("certificate", "path"), ("certificate", "worst_gap")}
)


@dataclass(frozen=True)
class Drawn:
    """What to log, and under which entity path."""

    entity: str
    archetype: rr.AsComponents


def draw(layer: Layer, frame: Frame | None, part: str = "") -> Iterator[Drawn]:
    """Everything that one layer logs; the map's share only where the frame is known.

    Layers of several vehicles or roles, the parts of a mission, lie beside one another.

    Parameters
    ----------
    layer
        What a stage showed.
    frame
        The site's plane; None where its origin is not known.
    part
        The vehicle or role that the layer is about, where there are several.

    Returns
    -------
    iterator of Drawn
        In the order in which they should be logged; empty for a layer without content.
    """
    within = f"/{rr.escape_entity_path_part(part)}" if part else ""
    entity = f"{layer.stage}/{layer.name}{within}"
    if layer.kind is LayerKind.GRAPH:
        yield from _graph(layer, entity)
    if layer.kind is LayerKind.GEOMETRY:
        yield from _flat(layer, entity)
        if frame is not None and (layer.stage, layer.name) in ON_MAP:
            yield from _on_map(layer, frame, entity)
    for name, value in layer.scalars.items():
        yield Drawn(f"{layer.stage}/{layer.name}/{name}{within}", rr.Scalars(value))
    if layer.text:
        level = rr.TextLogLevel.ERROR if layer.name == "failed" else rr.TextLogLevel.INFO
        yield Drawn(f"log/{layer.stage}", rr.TextLog(layer.text, level=level))


def _flat(layer: Layer, entity: str) -> Iterator[Drawn]:
    strips, owners = _strips(layer.geometries)
    colours = _colours(layer)
    show_labels = 0 < len(layer.labels) <= MOST_LABELS
    if strips:
        yield Drawn(
            f"{entity}/lines",
            rr.LineStrips2D(
                [strip * (1, -1) for strip in strips],
                colors=colours[owners],
                labels=_strip_labels(layer, owners),
                show_labels=show_labels,
                radii=layer.width_m / 2 if layer.width_m > 0 else rr.Radius.ui_points(1.0),
            ),
        )
    points, number = _points(layer.geometries)
    if len(points):
        yield Drawn(
            f"{entity}/points",
            rr.Points2D(
                points * (1, -1),
                colors=colours[number],
                labels=[layer.labels[index] for index in number] if layer.labels else None,
                show_labels=show_labels,
                radii=rr.Radius.ui_points(3.5),
            ),
        )


def _on_map(layer: Layer, frame: Frame, entity: str) -> Iterator[Drawn]:
    strips, owners = _strips(layer.geometries)
    colours = _colours(layer)
    if strips:
        lines = [frame.to_degrees(strip)[:, ::-1] for strip in strips]
        archetype = rr.GeoLineStrings(lat_lon=lines, colors=colours[owners], radii=rr.Radius.ui_points(1.5))
        yield Drawn(f"map/{entity}/lines", archetype)
    # Points by themselves: their size is one of the screen, not of the map.
    points, number = _points(layer.geometries)
    if len(points):
        places = frame.to_degrees(points)[:, ::-1]
        dots = rr.GeoPoints(lat_lon=places, colors=colours[number], radii=rr.Radius.ui_points(5.0))
        yield Drawn(f"map/{entity}/points", dots)


def _graph(layer: Layer, entity: str) -> Iterator[Drawn]:
    names = [str(index) for index in range(len(layer.nodes))]
    places = shapely.get_coordinates(np.asarray(layer.geometries)) if layer.geometries else None
    kinds = sorted(set(layer.nodes))
    hues = [TEAM[kinds.index(node) % len(TEAM)] for node in layer.nodes]
    yield Drawn(
        entity,
        rr.GraphNodes(
            names,
            labels=list(layer.nodes),
            colors=hues,
            positions=None if places is None else _on_screen(places),
            show_labels=len(names) <= MOST_LABELS,
        ),
    )
    edges = [(str(a), str(b)) for a, b in layer.edges]
    # Edges under another entity would join nodes of their own.
    yield Drawn(entity, rr.GraphEdges(edges, graph_type="undirected"))


def _on_screen(places: FloatArray) -> FloatArray:
    """Places in metres as those of nodes, whose size is one of the screen."""
    extent_m = float(np.ptp(places, axis=0).max())
    scale = NODE_APART * np.sqrt(len(places)) / extent_m if extent_m > 0 else 1.0
    return places * (scale, -scale)


def _strips(geometries: tuple[BaseGeometry, ...]) -> tuple[list[FloatArray], list[int]]:
    """All lines and rings, and the number of the geometry of each."""
    strips, owners = [], []
    for number, geometry in enumerate(geometries):
        for part in shapely.get_parts(geometry):
            lines = shapely.get_rings(part) if part.geom_type == "Polygon" else [part]
            for line in lines:
                if line.geom_type != "Point" and not line.is_empty:
                    strips.append(shapely.get_coordinates(line))
                    owners.append(number)
    return strips, owners


def _strip_labels(layer: Layer, owners: list[int]) -> list[str] | None:
    """The label of each geometry at its first line; its further ones, as the islands of a polygon, have none."""
    if not layer.labels:
        return None
    # Reversed, so that of several lines of a geometry the first is kept.
    first = dict(reversed([(owner, number) for number, owner in enumerate(owners)]))
    return [layer.labels[owner] if first[owner] == number else "" for number, owner in enumerate(owners)]


def _points(geometries: tuple[BaseGeometry, ...]) -> tuple[FloatArray, list[int]]:
    numbered = [(number, part) for number, whole in enumerate(geometries) for part in shapely.get_parts(whole)]
    points = [(number, part) for number, part in numbered if part.geom_type == "Point"]
    places = shapely.get_coordinates([part for _, part in points]) if points else np.empty((0, 2))
    return places, [number for number, _ in points]


def _colours(layer: Layer) -> np.ndarray[tuple[int, int], np.dtype[np.uint8]]:
    """One colour per geometry: by value, by vehicle, or the layer's, or the palette's."""
    if layer.values:
        share = np.clip(np.asarray(layer.values), 0.0, 1.0)[:, None]
        return np.asarray(NEAR + share * (FAR - NEAR), dtype=np.uint8)
    if (layer.stage, layer.name) in BY_VEHICLE:
        numbers = np.arange(len(layer.geometries)) % len(TEAM)
        return np.asarray(TEAM, dtype=np.uint8)[numbers]
    one = layer.colour or PALETTE.get((layer.stage, layer.name), OTHER)
    return np.tile(np.asarray(one, dtype=np.uint8), (len(layer.geometries), 1))
