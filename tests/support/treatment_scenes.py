"""Hot spots, fleets and requests for treatment, and what holds of every reply."""

from collections.abc import Sequence

import numpy as np
import pytest
import shapely
from shapely import Point, Polygon

from oxbow.arrays import Place
from oxbow.contracts import Assignment, AssignRequest, HotSpot, Role, Sortie, Vehicle

ROUNDING_M = 1e-5
CIRCLES = 1e-3
"""Share of an area by which discs of few corners may differ from those of many."""


def blob(rng: np.random.Generator, water: Polygon, radius_m: float) -> Polygon:
    """A ragged area somewhere about the water."""
    x0, y0, x1, y1 = water.bounds
    turn = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    radius = np.ones(40)
    for wave in range(1, 6):
        radius += rng.normal(0.0, 0.3 / wave) * np.cos(wave * turn + rng.uniform(0.0, 2.0 * np.pi))
    radius = radius_m * np.clip(radius, 0.3, 2.0)
    ring = rng.uniform((x0, y0), (x1, y1)) + np.column_stack([radius * np.cos(turn), radius * np.sin(turn)])
    return Polygon(ring)


def hot_spots(rng: np.random.Generator, water: Polygon, count: int, radius_m: float) -> tuple[HotSpot, ...]:
    """Hot spots apart from one another, each with some water."""
    areas: list[Polygon] = []
    while len(areas) < count:
        area = blob(rng, water, radius_m * rng.uniform(0.3, 1.5))
        if area.intersection(water).area > 0.05 * area.area and not shapely.intersects(areas, area).any():
            areas.append(area)
    return tuple(
        HotSpot(name=f"bloom {number}", area=area, value=float(rng.uniform(1.0, 5.0)))
        for number, area in enumerate(areas)
    )


def slave(
    place: Place,
    *,
    name: str = "boat",
    length_m: float = 1e6,
    speed_mps: float = 1.0,
    recovery: Place | None = None,
) -> Vehicle:
    return Vehicle(
        name=name,
        role=Role.SLAVE,
        length_m=length_m,
        speed_mps=speed_mps,
        start=place,
        recovery=recovery or place,
    )


def master(place: Place, *, name: str, length_m: float = 1e4, speed_mps: float = 1.0) -> Vehicle:
    return Vehicle(
        name=name, role=Role.MASTER, length_m=length_m, speed_mps=speed_mps, start=place, recovery=place
    )


def covered_share(water: Polygon, lines: Sequence[shapely.LineString], swath_m: float) -> float:
    """How much of some water lies within half a swath of lines."""
    swaths = shapely.union_all([line.buffer(swath_m / 2) for line in lines])
    return swaths.intersection(water).area / water.area


def require_sound(request: AssignRequest, reply: Assignment) -> None:
    """Sorties are within range and inside, their figures and shares true; nothing is forgotten."""
    for sortie in (*reply.sorties, *reply.further):
        _require_sound_sortie(request, sortie)
    names = [sortie.vehicle for sortie in reply.sorties]
    assert names == [vehicle.name for vehicle in request.vehicles if vehicle.name in names]
    assert reply.makespan_s == max((sortie.duration_s for sortie in reply.sorties), default=0.0)
    treated = {name for sortie in (*reply.sorties, *reply.further) for name in sortie.hot_spots}
    assert treated | {spot.hot_spot for spot in reply.left} == {spot.name for spot in request.hot_spots}
    paths = [sortie.path for sortie in reply.sorties]
    for spot, share in zip(request.hot_spots, reply.treated_share, strict=True):
        water = spot.area.intersection(request.free)
        expected = covered_share(water, paths, request.swath_m) if paths and water.area > 0.0 else 0.0
        assert share == pytest.approx(expected, abs=CIRCLES)
    worth = [spot.value_per_m for spot in reply.left]
    assert worth == sorted(worth, reverse=True)


def _require_sound_sortie(request: AssignRequest, sortie: Sortie) -> None:
    vehicle = next(vehicle for vehicle in request.vehicles if vehicle.name == sortie.vehicle)
    assert vehicle.role is Role.SLAVE
    assert sortie.path.length <= vehicle.length_m
    assert sortie.length_m == sortie.path.length
    assert sortie.duration_s == pytest.approx(sortie.path.length / vehicle.speed_mps)
    assert sortie.path.coords[0] == vehicle.start
    assert sortie.path.coords[-1] == vehicle.recovery
    assert sortie.hot_spots
    assert len(set(sortie.hot_spots)) == len(sortie.hot_spots)
    legs = [shapely.shortest_line(Point(place), request.free) for place in (vehicle.start, vehicle.recovery)]
    allowed = shapely.union_all([request.free, *legs]).buffer(ROUNDING_M)
    assert sortie.path.difference(allowed).length < ROUNDING_M
