"""Routes: length and clearance by method, all pairs of many places, and changes against rebuilds."""

from __future__ import annotations

import time
from collections.abc import Iterator
from itertools import combinations
from statistics import median

import numpy as np
import shapely
from shapely import Polygon

from oxbow.arrays import FloatArray
from oxbow.geometry.frame import Frame, lonlat
from oxbow.geometry.route import DynamicRouter, RouteMethod, make_router
from tests.bench.lakes import lake
from tests.bench.results import Figure, Goal, Section

__all__ = ["measure"]

LAKES = ((200, 5), (500, 20), (2_000, 60))
"""Vertices and islands of the random scenes."""

PLACES = 16
OFFSHORE_M = 20.0
"""Ends of routes are this far from the shore, so that clearance is the route's own."""

PAIRS_OF = 200
PAIRS_LIMIT_S = 5.0
ALL_PAIRS = ((1_000, 20), (2_000, 0), (2_000, 60), (10_000, 100))
CHANGES = 50


def measure() -> Iterator[Section]:
    """Three tables: methods on random scenes, all pairs by the visibility graph, changes of obstacles."""
    rows = [_method_row(method, vertices, islands) for vertices, islands in LAKES for method in RouteMethod]
    lattice, clear = ([row for row in rows if row["method"] == method] for method in ("tessellation", "incenters"))
    yield Section(
        "Routes by method, against the exact length, on random scenes",
        rows,
        goals=[
            Goal("lattice, 95th", max(float(row["95th"]) for row in lattice), " %", at_most=1.5),
            Goal("incenters, least clearance", min(float(row["least"]) for row in clear), " m", at_least=1.0),
        ],
        note=f"clearance: least distance from the shore, of routes whose ends are {OFFSHORE_M:g} m from it",
    )
    rows = [_pairs_row(vertices, islands) for vertices, islands in ALL_PAIRS]
    slowest_s = max(float(row["graph s"]) + float(row["pairs s"]) for row in rows if row["vertices"] == 2_000)
    yield Section(
        f"Exact distances between all pairs of {PAIRS_OF} places",
        rows,
        goals=[Goal("all pairs, 2 000 vertices", slowest_s, " s", at_most=PAIRS_LIMIT_S)],
    )
    yield Section(
        "An obstacle comes, moves or goes: local change against a rebuild, ms",
        [_change_row(vertices, islands) for vertices, islands in ALL_PAIRS],
    )


def _water(vertices: int, islands: int, seed: int = 0) -> Polygon:
    mission = lake(vertices, islands, seed=seed)
    degrees = [lonlat(ring) for ring in (mission.outline, *mission.forbidden_zones)]
    shore, *rims = map(Frame.around(degrees[0]).to_planar, degrees)
    return Polygon(shore, rims)


def _places(water: Polygon, count: int, seed: int = 0) -> FloatArray:
    rng = np.random.default_rng(seed)
    offshore = water.buffer(-OFFSHORE_M)
    low, high = np.reshape(water.bounds, (2, 2))
    places = rng.uniform(low, high, (100 * count, 2))
    return np.asarray(places[shapely.contains_xy(offshore, places)][:count])


def _method_row(method: RouteMethod, vertices: int, islands: int) -> dict[str, Figure]:
    water = _water(vertices, islands)
    places = _places(water, PLACES)
    exact = make_router(RouteMethod.VISIBILITY, water).distances(places)
    router = make_router(method, water)
    router.route(places[0], places[1])
    started = time.perf_counter()
    pairs = list(combinations(range(PLACES), 2))
    routes = [router.route(places[i], places[j]) for i, j in pairs]
    spent_ms = 1e3 * (time.perf_counter() - started) / len(pairs)
    excess = [100.0 * (route.length_m / exact[pair] - 1.0) for route, pair in zip(routes, pairs, strict=True)]
    clearance = [route.clearance_m for route in routes]
    return {
        "method": method.value,
        "vertices": vertices,
        "islands": islands,
        "longer %, median": median(excess),
        "95th": float(np.percentile(excess, 95)),
        "worst": max(excess),
        "clearance m, median": median(clearance),
        "least": min(clearance),
        "ms/route": spent_ms,
    }


def _pairs_row(vertices: int, islands: int) -> dict[str, Figure]:
    water = _water(vertices, islands)
    places = _places(water, PAIRS_OF)
    started = time.perf_counter()
    router = make_router(RouteMethod.VISIBILITY, water)
    router.distances(places[:1])
    built = time.perf_counter()
    router.distances(places)
    return {
        "vertices": vertices,
        "islands": islands,
        "graph s": built - started,
        "pairs s": time.perf_counter() - built,
    }


def _change_row(vertices: int, islands: int) -> dict[str, Figure]:
    """Obstacles of some 50 m wander over the lake."""
    water = _water(vertices, islands)
    rng = np.random.default_rng(0)
    router = DynamicRouter(water)
    local_ms, rebuild_ms = [], []
    for number, centre in enumerate(_places(water, CHANGES)):
        obstacle = shapely.Point(centre).buffer(rng.uniform(20.0, 80.0), quad_segs=2)
        started = time.perf_counter()
        router.put(f"obstacle {number % 10}", obstacle)
        local_ms.append(1e3 * (time.perf_counter() - started))
        started = time.perf_counter()
        DynamicRouter(water.difference(shapely.union_all(list(router.obstacles.values()))))
        rebuild_ms.append(1e3 * (time.perf_counter() - started))
    return {
        "vertices": vertices,
        "islands": islands,
        "local, median": median(local_ms),
        "rebuild, median": median(rebuild_ms),
        "times faster": median(rebuild_ms) / median(local_ms),
    }
