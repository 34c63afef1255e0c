"""Shares count the way there and home: within reach, as even as that allows, and what none can reach is named."""

import itertools
import math

import pytest
import shapely
from msgspec.structs import replace
from shapely import LineString, Point, Polygon, box

from oxbow.arrays import FloatArray, Place
from oxbow.contracts import Assignment, AssignRequest, Vehicle
from oxbow.errors import Infeasible
from oxbow.geometry.route import Routes, lengths_from, way_to
from oxbow.wire.recording import discard
from oxbow_assignment.service import handle
from oxbow_assignment.shares.partition import BALANCE
from oxbow_assignment.shares.reach import SPARE
from oxbow_assignment.shares.sharing import TRIANGLES, share_water
from tests.support.path_requests import lake
from tests.support.treatment_scenes import master

CANAL = box(0, 0, 5_000, 8)
WEST, EAST = (0.0, 4.0), (5_000.0, 4.0)
EDGE_M = 15.0
"""Triangles of the canal's shares are no longer."""


def boats(*lengths_m: float, place: Place = WEST, recovery: Place | None = None) -> tuple[Vehicle, ...]:
    return tuple(
        replace(master(place, name=f"{number}", length_m=length_m), recovery=recovery or place)
        for number, length_m in enumerate(lengths_m)
    )


def shares(free: Polygon, vehicles: tuple[Vehicle, ...]) -> Assignment:
    """Shares that together with what is dropped are the free space, each within its vehicle's reach."""
    found = handle(AssignRequest(free=free, vehicles=vehicles, share_free=True), discard)
    areas = [share.area for share in found.shares]
    assert [share.vehicle for share in found.shares] == [vehicle.name for vehicle in vehicles]
    assert all(isinstance(area, Polygon) and area.is_valid and area.area > 0 for area in areas)
    parts = [*areas, *(part.outline for part in found.dropped)]
    assert sum(part.area for part in parts) == pytest.approx(free.area, rel=1e-9)
    assert shapely.union_all(parts).symmetric_difference(free).area <= 1e-6 * free.area
    return found


def dropped_m2(found: Assignment) -> float:
    return sum(part.area_m2 for part in found.dropped)


def span(found: Assignment, name: str) -> tuple[float, float]:
    """Where a share of the canal begins and ends."""
    (area,) = [share.area for share in found.shares if share.vehicle == name]
    return area.bounds[0], area.bounds[2]


@pytest.mark.parametrize("count", [2, 3, 5])
def test_what_no_boat_can_see_and_be_home_is_dropped_by_name(count):
    found = shares(CANAL, boats(*[8_000.0] * count))
    (part,) = found.dropped
    assert part.area_m2 == pytest.approx(8 * 1_000, abs=8 * (40 + EDGE_M))
    assert part.outline.bounds[2] == 5_000
    assert part.reason == "too far for the vehicles: none can go there and home within its length"
    assert CANAL.covers(Point(part.place))
    # Each can go to the end of its share and home.
    for number in range(count):
        assert 2 * span(found, f"{number}")[1] <= 8_000.0
    assert "shares are not even" in found.warnings[0]
    left_out = f"{part.area_m2 / CANAL.area:.1%} of the water is left out, most of it {part.reason}"
    assert found.warnings[1:] == (left_out,)


def test_far_shares_are_the_smaller():
    found = shares(CANAL, boats(20_000.0, 20_000.0, 20_000.0))
    assert dropped_m2(found) == 0.0
    assert found.imbalance <= BALANCE
    spacings = []
    for share in found.shares:
        left_m = 20_000.0 - 2 * max(share.area.bounds[0], 0.0)
        spacings.append(share.area.area / left_m)
    assert max(spacings) <= (1 + 2 * BALANCE) * min(spacings)
    assert not found.warnings


def test_what_is_due_to_boats_but_out_of_their_reach_is_passed_on_to_those_beyond():
    """Together, the four of short range are due more than the 1500 m of the canal that they reach."""
    found = shares(CANAL, boats(*[3_000.0] * 4, 12_000.0, 12_000.0))
    assert dropped_m2(found) == 0.0
    assert found.imbalance <= BALANCE


@pytest.mark.parametrize("order", list(itertools.permutations([3_000.0, 6_000.0, 12_000.0])))
def test_far_water_goes_to_those_who_reach_it(order):
    found = shares(CANAL, boats(*order))
    assert dropped_m2(found) == 0.0
    for number, length_m in enumerate(order):
        assert 2 * span(found, f"{number}")[1] <= length_m
    assert span(found, f"{order.index(12_000.0)}")[1] == 5_000


def test_boats_from_both_ends_share_all():
    fleet = (*boats(6_000.0), replace(boats(6_000.0, place=EAST)[0], name="east"))
    found = shares(CANAL, fleet)
    assert dropped_m2(found) == 0.0
    assert span(found, "0")[1] == pytest.approx(2_500, abs=2 * EDGE_M)
    assert found.imbalance <= BALANCE


def test_boats_from_both_ends_leave_what_lies_between_them():
    fleet = (*boats(2_000.0, 2_000.0), replace(boats(2_000.0, place=EAST)[0], name="east"))
    found = shares(CANAL, fleet)
    assert dropped_m2(found) == pytest.approx(8 * 3_000, abs=8 * (20 + 2 * EDGE_M))
    assert span(found, "east")[0] >= 4_000


def test_who_is_recovered_at_the_far_end_sees_all():
    found = shares(CANAL, boats(8_000.0, 8_000.0, recovery=EAST))
    assert dropped_m2(found) == 0.0


def test_an_arm_is_nobodys_where_none_can_see_it():
    arm = box(1_000, 8, 1_008, 4_000)
    found = shares(shapely.union_all([box(0, 0, 2_000, 8), arm]), boats(6_000.0, 5_000.0))
    assert dropped_m2(found) == pytest.approx(8 * 2_000, abs=8 * (30 + 2 * EDGE_M))
    assert found.dropped[0].outline.bounds[3] == 4_000


@pytest.mark.parametrize("order", list(itertools.permutations([9_000.0, 9_000.0, 12_000.0]))[:3])
def test_the_farthest_arm_goes_to_who_reaches_it(order):
    arm = box(2_000, 8, 2_008, 2_000)
    found = shares(shapely.union_all([CANAL, arm]), boats(*order))
    assert dropped_m2(found) == 0.0
    assert span(found, f"{order.index(12_000.0)}")[1] == 5_000
    assert found.imbalance <= BALANCE


def test_a_strip_is_shared_in_triangles_as_long_as_they_suffice():
    strip = box(0, 0, 500, 0.1)
    vehicles = boats(2_000.0, 2_000.0, 2_000.0, place=(0.0, 0.0))
    sharing = share_water(strip, vehicles)
    assert len(sharing.partition.mesh) <= 3 * TRIANGLES * len(vehicles)
    assert sharing.imbalance <= BALANCE


def test_who_reaches_nothing_is_named():
    with pytest.raises(
        Infeasible,
        match=r"'1': length_m: is 100 m; expected more than 1013\.\d m: .* home is 1003\.",
    ):
        shares(CANAL, (*boats(8_000.0), replace(boats(100.0, place=(-500.0, 4.0))[0], name="1")))


@pytest.mark.parametrize("ranges", [(0.6, 2.0), (2.0, 0.6)])
def test_shares_of_a_lake_are_within_reach(ranges):
    free = lake(3)
    x0, y0, x1, y1 = free.bounds
    start = free.exterior.coords[0]
    fleet = tuple(
        master(start, name=f"{number}", length_m=each * max(x1 - x0, y1 - y0))
        for number, each in enumerate(ranges)
    )
    found = shares(free, fleet)
    edge_m = math.sqrt(free.area / (100 * len(fleet)))
    for share, vehicle in zip(found.shares, fleet, strict=True):
        assert _round_trips_m(free, vehicle, share.area).max() <= (1.0 - SPARE) * vehicle.length_m + 4 * edge_m
    for part in found.dropped:
        for vehicle in fleet if part.reason.endswith("within its length") else ():
            assert _round_trips_m(free, vehicle, part.outline).max() > (1.0 - SPARE) * vehicle.length_m


def _round_trips_m(free: Polygon, vehicle: Vehicle, area: Polygon) -> FloatArray:
    """From a vehicle's start to the corners of an area and home."""
    way = way_to(free, Routes(free), vehicle.start)
    corners = shapely.get_coordinates(area)
    return 2.0 * (lengths_from(free, way[-1:], corners)[0] + LineString(way).length)
