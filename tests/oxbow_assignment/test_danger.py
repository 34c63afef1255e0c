"""Danger zones in treatments: gone round where that is worth it, and told by the certificate."""

import msgspec
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon, box

from oxbow.contracts import (
    Assignment,
    AssignRequest,
    CertifyRequest,
    Conformance,
    DangerZone,
    HotSpot,
    Per,
    Sortie,
    Vehicle,
)
from oxbow.errors import Infeasible
from oxbow.geometry.route import Danger, RouteMethod
from oxbow.wire.codec import encode
from oxbow.wire.recording import Layer, discard
from oxbow_assignment.service import handle
from oxbow_certificate.certify import certify
from tests.support.path_requests import lake
from tests.support.treatment_scenes import blob, hot_spots, require_sound, slave

quick = settings(max_examples=10)
replaced = msgspec.structs.replace

POND = box(0, 0, 1_000, 600)
START = (0.0, 300.0)
REEF = box(400, 100, 500, 610)
"""It reaches the northern shore; the way round its southern end is 133 m longer."""
BAR = box(400, -10, 500, 610)
"""No way leads round it."""
SPOT = HotSpot(name="bloom", area=box(700, 295, 760, 305), value=1.0)
REQUEST = AssignRequest(free=POND, vehicles=(slave(START, length_m=4_000.0),), hot_spots=(SPOT,), swath_m=10.0)


def zone(area: Polygon = REEF, probability: float = 0.5, per: Per = Per.CROSSING) -> DangerZone:
    return DangerZone(name="reef", area=area, probability=probability, per=per)


def reply(*zones: DangerZone, **changes) -> Assignment:
    return handle(replaced(REQUEST, danger_zones=zones, **changes), discard)


def ragged(rng: np.random.Generator, water: Polygon, radius_m: float) -> Polygon:
    """A ragged area of few corners: every two that see each other make an edge to be measured."""
    return blob(rng, water, radius_m).simplify(radius_m / 10).buffer(0.0)


def judged(sortie: Sortie, *zones: DangerZone, others: tuple[Sortie, ...] = ()) -> Conformance:
    tracks = [{"path": each.path, "launch": START, "recovery": START} for each in (sortie, *others)]
    request = CertifyRequest(outline=POND, danger_zones=zones, **tracks[0])
    return certify(replaced(request, others=tuple(replaced(request, **track) for track in tracks[1:])))


@pytest.mark.parametrize(("detour_m", "crossings"), [(1_000.0, 0), (150.0, 2), (0.0, 2)])
def test_the_route_between_goes_round_where_that_is_worth_it(detour_m, crossings):
    (sortie,) = reply(zone(), danger_detour_m=detour_m).sorties
    plain = reply().sorties[0].length_m
    assert sortie.path.crosses(REEF) is bool(crossings)
    assert judged(sortie, zone()).danger == pytest.approx(1.0 - 0.5**crossings)
    assert sortie.length_m == pytest.approx(plain if crossings else plain + 2 * 133.5, abs=25.0)


def test_the_danger_of_metres_is_told():
    bar = zone(BAR, 0.001, Per.METRE)
    (sortie,) = reply(bar).sorties
    assert judged(sortie, bar).danger == pytest.approx(1.0 - 0.999 ** (2 * 100), abs=1e-4)


def test_any_of_several_vehicles_may_come_to_harm():
    (sortie,) = reply(zone(BAR, 0.2)).sorties
    both = judged(sortie, zone(BAR, 0.2), others=(sortie,))
    assert [track.danger for track in both.tracks] == pytest.approx([1.0 - 0.8**2] * 2)
    assert both.danger == pytest.approx(1.0 - 0.8**4)
    assert judged(sortie).danger is None
    assert judged(sortie, zone(box(5, 550, 10, 600))).danger == 0.0


def boat(length_m: float = 4_000.0, **more) -> Vehicle:
    return replaced(slave(START, length_m=length_m), **more)


def test_danger_is_no_length():
    """What a zone is worth keeps nobody home, whether it is crossed or never entered."""
    plain_m = reply().sorties[0].length_m
    crossed = reply(zone(BAR, 0.999), vehicles=(boat(plain_m + 1.0, danger_factor=100.0),))
    assert (crossed.left, [sortie.length_m for sortie in crossed.sorties]) == ((), [pytest.approx(plain_m)])
    beside = reply(zone(box(0, 500, 1_000, 610), 0.999), vehicles=(boat(plain_m + 1.0),))
    assert encode(beside) == encode(reply(vehicles=(boat(plain_m + 1.0),)))


def test_what_a_detour_makes_too_far_is_left_with_metres_that_are_travelled():
    (left,) = reply(zone(), vehicles=(boat(1_600.0),)).left
    assert "would travel 1705 m" in left.reason
    assert "m there and home, round danger zones where that is worth it" in left.reason
    assert not reply(zone(), vehicles=(boat(1_900.0),)).left


@quick
@given(
    seed=st.integers(0, 10_000),
    factors=st.lists(st.floats(1.0, 30.0), min_size=2, max_size=3),
    crossing=st.floats(0.0, 0.6),
    metre=st.floats(0.0, 3e-3),
)
def test_a_sortie_never_takes_more_danger_for_who_is_less_fit(seed, factors, crossing, metre):
    rng = np.random.default_rng(seed)
    zones = (
        DangerZone(name="lane", area=ragged(rng, POND, 150.0), probability=crossing),
        DangerZone(name="shallows", area=ragged(rng, POND, 150.0), probability=metre, per=Per.METRE),
    )
    taken = []
    for factor in sorted(factors):
        (sortie,) = reply(*zones, vehicles=(boat(1e5, danger_factor=factor),), danger_detour_m=150.0).sorties
        taken.append(Danger(zones).probability(shapely.get_coordinates(sortie.path)))
    assert (np.diff(taken) <= 1e-6).all()


def test_a_vehicle_is_less_fit_for_some_hot_spots():
    near = HotSpot(name="near", area=box(700, 335, 760, 345), value=1.0)
    for spot, crossings in (("bloom", 0), ("near", 2)):
        unfit = boat(danger_factors={"bloom": 20.0})
        only = replaced(near, name=spot)
        (sortie,) = reply(zone(), vehicles=(unfit,), hot_spots=(only,), danger_detour_m=150.0).sorties
        assert judged(sortie, zone()).danger == pytest.approx(1.0 - 0.5**crossings)


def test_a_factor_for_no_hot_spot_is_a_warning():
    (warning,) = reply(zone(), vehicles=(boat(danger_factors={"blom": 20.0}),)).warnings
    assert warning == "a danger factor of vehicle 'boat' is for 'blom', which is no hot spot to be treated"


def test_less_fit_between_hot_spots_too():
    """The bar between two hot spots has to be crossed; the reef is gone round by who is unfit."""
    spots = (SPOT, HotSpot(name="west", area=box(250, 295, 310, 305), value=1.0))
    for factor, danger in ((1.0, 0.75), (20.0, 0.0)):
        fleet = (boat(danger_factor=factor),)
        (sortie,) = reply(zone(), vehicles=fleet, hot_spots=spots, danger_detour_m=150.0).sorties
        assert judged(sortie, zone()).danger == pytest.approx(danger)


def test_who_is_less_fit_is_sent_less():
    for fit, unfit in (("one", "two"), ("two", "one")):
        fleet = tuple(
            replaced(slave(START, name=name, length_m=4_000.0), danger_factor=3.0 if name == unfit else 1.0)
            for name in ("one", "two")
        )
        sorties = reply(zone(BAR), vehicles=fleet, danger_detour_m=100.0).sorties
        assert [sortie.vehicle for sortie in sorties] == [fit]


def test_without_zones_nothing_changes():
    free, rng = lake(5), np.random.default_rng(5)
    fleet = tuple(slave((0.0, 0.0), name=name, length_m=6_000.0) for name in "ab")
    request = AssignRequest(free=free, vehicles=fleet, hot_spots=hot_spots(rng, free, 6, 150.0), swath_m=30.0)
    less_fit = tuple(replaced(vehicle, danger_factor=9.0) for vehicle in fleet)
    other = replaced(request, vehicles=less_fit, danger_detour_m=7.0)
    assert encode(handle(other, discard)) == encode(handle(request, discard))


def test_zones_and_the_routes_of_every_method_are_shown():
    layers: list[Layer] = []
    request = replaced(REQUEST, danger_zones=(zone(),))
    (sortie,) = handle(request, layers.append).sorties
    shown = {layer.name: layer for layer in layers}
    assert shown["danger_zones"].labels == ("reef: danger 0.5 per crossing",)
    assert shown["danger_zones"].values == (0.5,)
    routes = {method: shown[f"routes_{method}"] for method in RouteMethod}
    for layer in routes.values():
        assert [leg.coords[0] for leg in layer.geometries] == [leg.coords[0] for leg in shown["routes"].geometries]
        assert all(not leg.crosses(REEF) for leg in layer.geometries)
        assert all(" m from the shore" in label for label in layer.labels)
    assert routes[RouteMethod.VISIBILITY].geometries == shown["routes"].geometries
    lengths_m = [sum(leg.length for leg in layer.geometries) for layer in routes.values()]
    assert min(lengths_m) == lengths_m[0]
    assert handle(request, discard).sorties == (sortie,)


@quick
@given(seed=st.integers(0, 10_000), factor=st.sampled_from([1.0, 1.05]), detour_m=st.sampled_from([50.0, 2_000.0]))
def test_sorties_among_danger_zones_are_sound(seed, factor, detour_m):
    free, rng = lake(seed, vertices=60), np.random.default_rng(seed)
    x0, y0, x1, y1 = free.bounds
    places = rng.uniform((x0, y0), (x1, y1), (4, 2)).tolist()
    fleet = tuple(
        replaced(
            slave(tuple(places[k]), name=f"{k}", length_m=8_000.0, recovery=tuple(places[k + 2])),
            danger_factor=factor**k,
        )
        for k in range(2)
    )
    zones = tuple(
        DangerZone(name=f"{per}", area=ragged(rng, free, 300.0), probability=probability, per=per)
        for per, probability in ((Per.CROSSING, 0.3), (Per.METRE, 1e-3))
    )
    request = AssignRequest(
        free=free,
        vehicles=fleet,
        hot_spots=hot_spots(rng, free, 5, 150.0),
        swath_m=40.0,
        danger_zones=zones,
        danger_detour_m=detour_m,
    )
    try:
        found = handle(request, discard)
    except Infeasible as error:
        assert "outside the free space" in str(error)
        return
    require_sound(request, found)
