"""Requests for the path stage, made by the real stages before it."""

import itertools
import math
import re
from typing import Any

import numpy as np
import shapely
from shapely import Polygon

from oxbow.arrays import Place
from oxbow.contracts import ContourRequest, DecomposeRequest, Method, PathPlan, PathRequest
from oxbow.contracts.budget import nominal_spacing_m
from oxbow.errors import Infeasible, renamed
from oxbow.testing import nasty_polygons
from oxbow.wire.recording import discard
from oxbow_contour.service import handle as contour
from oxbow_decomposition.service import handle as decompose
from oxbow_path.service import planned_path


def lake(seed: int, *, roughness: float = 0.3, vertices: int = 150, radius_m: float = 1000.0) -> Polygon:
    """A ragged lake with a few islands."""
    rng = np.random.default_rng(seed)
    turn = np.linspace(0, 2 * np.pi, vertices, endpoint=False)
    radius = np.ones(vertices)
    for wave in range(1, 10):
        radius += rng.normal(0, roughness / wave) * np.cos(wave * turn + rng.uniform(0, 2 * np.pi))
    radius = radius_m * np.clip(radius, 0.25, 2.5)
    outline = Polygon(np.column_stack([radius * np.cos(turn), radius * np.sin(turn)]))
    islands = [
        shapely.Point(*rng.uniform(-0.8, 0.8, 2) * radius_m).buffer(rng.uniform(0.03, 0.15) * radius_m)
        for _ in range(rng.integers(0, 5))
    ]
    inner = [island for island in islands if outline.buffer(-0.02 * radius_m).contains(island)]
    water = outline.difference(shapely.union_all(inner)) if inner else outline
    return max(shapely.get_parts(water), key=lambda part: part.area)


def request(
    water: Polygon,
    *,
    spacings: float = 15.0,
    safety: float = 0.01,
    launch: Place | None = None,
    recovery: Place | None = None,
    min_spacing_m: float = 0.0,
    heading_rad: float | None = None,
    method: Method = Method.TRANSECT,
    time_limit_s: float | None = None,
) -> PathRequest:
    """A request for some water: `spacings` is the length, and `safety` the distance, over the root of the area."""
    scale_m = math.sqrt(water.area)
    length_m = spacings * scale_m
    spacing_m = nominal_spacing_m(water.area, length_m)
    launch = launch or water.exterior.coords[0]
    outline, zones = Polygon(water.exterior), tuple(Polygon(ring) for ring in water.interiors)
    asked = ContourRequest(
        outline=outline,
        zones=zones,
        safety_m=safety * scale_m,
        spacing_m=spacing_m,
        places=(launch, recovery or launch),
        shore_tolerance_m=scale_m,
    )
    with renamed({"places[0]": "launch", "places[1]": "recovery"}):
        space = contour(asked, discard)
    cells = decompose(DecomposeRequest(free=space.free, spacing_m=spacing_m, heading_rad=heading_rad), discard)
    return PathRequest(
        method=method,
        space=space,
        decomposition=cells,
        launch=launch,
        recovery=recovery or launch,
        length_m=length_m,
        min_spacing_m=min_spacing_m,
        time_limit_s=time_limit_s,
    )


def nasty_request(name: str, spacings: float, **more: Any) -> PathRequest | None:
    """A request for a nasty shape; None for those that are rightly refused: any other has to have a path.

    Slivers are narrower than twice the safety distance. Of two basins alike, the launch may be by the one that
    is taken for the lesser.
    """
    water = nasty_polygons()[name]
    refusal = (
        "safety_m: " if "sliver" in name else "launch: lies by .* narrower than" if name == "strait" else None
    )
    try:
        asked = request(water, spacings=spacings, **more)
    except Infeasible as error:
        if refusal is None or not re.match(refusal, str(error)):
            raise
        return None
    assert "sliver" not in name
    return asked


def soon_planned(asked: PathRequest, steps: int = 2) -> PathPlan:
    """The plan of a request with a time limit, of which each step of an improvement takes the same part.

    A path is improved by as many steps on any machine, whatever else that does.
    """
    assert asked.time_limit_s is not None
    taken = itertools.count()
    return planned_path(asked, lambda: next(taken) >= steps, discard)
