"""What a stage shows of its work: named layers of geometry, published on the bus for recorders and viewers.

A stage calls `show(Layer(...))`; it neither knows nor waits for a recorder. This module does no drawing.
"""

from __future__ import annotations

import enum
from collections.abc import Callable

import msgspec
from shapely.geometry.base import BaseGeometry

__all__ = ["Colour", "Layer", "LayerKind", "Show", "Stamped", "discard", "is_watched"]

Colour = tuple[int, int, int]


class LayerKind(enum.StrEnum):
    """How a layer is drawn."""

    GEOMETRY = "geometry"
    GRAPH = "graph"
    SCALARS = "scalars"
    LOG = "log"


class Layer(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One named layer of a stage.

    Parameters
    ----------
    stage, name
        The layer's place in the recording, e.g. ``contour`` / ``simplified``.
    step
        The iteration that it belongs to; layers of one name are played in order of their steps.
    geometries
        Points, lines and polygons in planar metres (of the mission's frame).
    labels, values
        One per geometry, or none at all. Values (0..1) colour the geometries on the recorder's scale.
    colour
        One colour for the whole layer; by default, the recorder chooses from its palette.
    nodes, edges
        A graph's node labels and its edges as pairs of node indices; its geometries are the nodes' places.
    scalars
        Named figures of this step (timings in s, lengths in m, ...).
    text
        A line for the log.

    Raises
    ------
    ValueError
        There are some `labels` or `values`, but not one per geometry.
    """

    stage: str
    name: str
    kind: LayerKind = LayerKind.GEOMETRY
    step: int = 0
    geometries: tuple[BaseGeometry, ...] = ()
    labels: tuple[str, ...] = ()
    values: tuple[float, ...] = ()
    colour: Colour | None = None
    width_m: float = 0.0
    nodes: tuple[str, ...] = ()
    edges: tuple[tuple[int, int], ...] = ()
    scalars: dict[str, float] = {}
    text: str = ""

    def __post_init__(self) -> None:
        for field in ("labels", "values"):
            given = len(getattr(self, field))
            if given not in (0, len(self.geometries)):
                raise ValueError(
                    f"layer {self.stage}/{self.name}: {given} {field} for {len(self.geometries)} geometries;"
                    " give none or one for each"
                )


class Stamped(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A layer as it travels on the bus: with its mission, the time it was shown, and the origin of its plane.

    Parameters
    ----------
    mission_id
        The mission whose recording it belongs to.
    origin
        Latitude and longitude (degrees, WGS84) of the planar frame's origin; no map is drawn where it is absent.
    request_id
        The run of the mission: another run of one mission is another recording.
    time_s
        Unix time at which the stage showed the layer.
    part
        The vehicle or the role that the layer is about, where a mission has several.
    layer
        What was shown.
    """

    mission_id: str
    origin: tuple[float, float] | None = None
    request_id: str = ""
    time_s: float
    part: str = ""
    layer: Layer


Show = Callable[[Layer], None]
"""The function that a stage shows its layers with."""


def discard(layer: Layer) -> None:
    """Ignore the layer: for callers without a recording."""


def is_watched(show: Show) -> bool:
    """Whether layers go anywhere; where they do not, work that only serves a layer may be skipped."""
    return show is not discard
