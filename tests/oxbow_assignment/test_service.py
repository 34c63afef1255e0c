"""The stage: shares that tile the water, sorties that keep to range and water, and nothing forgotten."""

import msgspec
import numpy as np
import pytest
import shapely
import shapely.affinity
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon, box

from oxbow.contracts import Assignment, AssignRequest, ContourRequest, HotSpot
from oxbow.errors import Infeasible, InvalidRequest
from oxbow.geometry.route import RouteMethod
from oxbow.mission.file import read_mission
from oxbow.site.site import Site
from oxbow.testing import nasty_polygons
from oxbow.wire.codec import decode, encode
from oxbow.wire.recording import Layer, discard
from oxbow_assignment.service import handle
from oxbow_assignment.shares.partition import BALANCE
from oxbow_assignment.treatment.campaign import plan_campaign
from oxbow_contour.service import handle as contour
from tests.support.path_requests import lake
from tests.support.real_lakes import MISSIONS, needs_missions
from tests.support.treatment_scenes import hot_spots, master, require_sound, slave

quick = settings(max_examples=8)
replaced = msgspec.structs.replace

POND = box(0, 0, 1_000, 600)
SPOTS = (
    HotSpot(name="north", area=box(200, 400, 300, 450), value=2.0),
    HotSpot(name="south", area=box(600, 100, 650, 200), value=1.0),
    HotSpot(name="east", area=box(900, 300, 980, 340), value=3.0),
)
FLEET = (
    slave((0.0, 300.0), name="one", length_m=4_000.0),
    slave((0.0, 0.0), name="two", length_m=3_000.0, speed_mps=2.0),
    master((0.0, 0.0), name="three"),
)
REQUEST = AssignRequest(free=POND, vehicles=FLEET, hot_spots=SPOTS, swath_m=10.0)


def reply(request: AssignRequest = REQUEST, **changes) -> Assignment:
    return handle(replaced(request, **changes), discard)


# ----------------------------------------------------------------------------- treatment


@quick
@given(
    seed=st.integers(0, 10_000),
    boats=st.integers(1, 3),
    spread=st.floats(1.0, 20.0),
    apart=st.booleans(),
)
def test_sorties_over_lakes_are_sound(seed, boats, spread, apart):
    free, rng = lake(seed), np.random.default_rng(seed)
    x0, y0, x1, y1 = free.bounds
    places = rng.uniform((x0, y0), (x1, y1), (2 * boats, 2)).tolist()
    fleet = tuple(
        slave(
            tuple(places[0]),
            name=f"boat {number}",
            length_m=spread * rng.uniform(1_000.0, 2_000.0),
            speed_mps=rng.uniform(1.0, 2.0),
            recovery=tuple(places[1 if apart else 0]),
        )
        for number in range(boats)
    )
    request = AssignRequest(free=free, vehicles=fleet, hot_spots=hot_spots(rng, free, 6, 150.0), swath_m=40.0)
    try:
        found = reply(request)
    except Infeasible as error:
        assert "outside the free space" in str(error)
        return
    require_sound(request, found)


@quick
@given(seed=st.integers(0, 10_000), boats=st.integers(1, 3))
def test_where_lengths_suffice_all_is_treated_at_once(seed, boats):
    free, rng = lake(seed, vertices=60), np.random.default_rng(seed)
    start = free.exterior.coords[0]
    fleet = tuple(slave(start, name=f"boat {number}") for number in range(boats))
    request = AssignRequest(free=free, vehicles=fleet, hot_spots=hot_spots(rng, free, 5, 150.0), swath_m=30.0)
    found = reply(request)
    require_sound(request, found)
    assert min(found.treated_share) >= 0.99
    assert not found.further
    assert not found.left
    assert len(found.sorties) == boats


@pytest.mark.parametrize("name", sorted(name for name in nasty_polygons() if "sliver" not in name)[::2])
def test_sorties_over_nasty_waters_are_sound(name):
    free = nasty_polygons()[name]
    x0, y0, x1, y1 = free.bounds
    tiles = [box(x0 + i * (x1 - x0) / 3, y0, x0 + (i + 1) * (x1 - x0) / 3, y1) for i in range(3)]
    spots = tuple(HotSpot(name=f"tile {i}", area=tile, value=1.0 + i) for i, tile in enumerate(tiles))
    start = (x0 - 1.0, y0 - 1.0)
    fleet = (slave(start, name="far", length_m=2_000.0), slave(start, name="near", length_m=500.0))
    request = AssignRequest(free=free, vehicles=fleet, hot_spots=spots, swath_m=10.0)
    require_sound(request, reply(request))


def test_a_huge_hot_spot_is_treated_in_several_sorties():
    request = replaced(REQUEST, hot_spots=(HotSpot(name="bloom", area=box(100, 100, 900, 500), value=1.0),))
    found = reply(request)
    require_sound(request, found)
    assert not found.left
    assert {sortie.hot_spots for sortie in (*found.sorties, *found.further)} == {("bloom",)}
    passes_m = 800 * 400 / 10
    assert len(found.sorties) + len(found.further) <= 1.5 * passes_m / (3_000 - 1_000)
    paths = [sortie.path for sortie in (*found.sorties, *found.further)]
    treated = shapely.union_all([path.buffer(5.0) for path in paths])
    assert treated.intersection(request.hot_spots[0].area).area >= 0.99 * request.hot_spots[0].area.area


def test_what_does_not_fit_goes_further():
    """Two that are worth less in all than the third are near enough to be treated together, later."""
    spots = (*SPOTS[:2], replaced(SPOTS[2], value=4.0))
    request = replaced(REQUEST, vehicles=(slave((0.0, 300.0), length_m=2_600.0),), hot_spots=spots)
    found = reply(request)
    require_sound(request, found)
    assert [sortie.hot_spots for sortie in found.sorties] == [("east",)]
    assert [sorted(sortie.hot_spots) for sortie in found.further] == [["north", "south"]]
    assert found.treated_share == pytest.approx((0.0, 0.0, 1.0))


def test_what_is_out_of_reach_is_left_with_figures():
    request = replaced(REQUEST, vehicles=(slave((0.0, 300.0), length_m=1_200.0),))
    found = reply(request)
    require_sound(request, found)
    assert [spot.hot_spot for spot in found.left] == ["east", "south"]
    for spot in found.left:
        assert "of passes are out of reach: 'boat' would travel 1" in spot.reason
        assert "may travel 1200 m" in spot.reason
    assert found.treated_share == pytest.approx((1.0, 0.0, 0.0))


def test_a_hot_spot_without_water_is_left():
    dry = HotSpot(name="dry", area=box(2_000, 0, 2_100, 100), value=9.0)
    found = reply(hot_spots=(dry, *SPOTS))
    assert [spot.hot_spot for spot in found.left] == ["dry"]
    assert found.left[0].reason.startswith("has no water in the free space, 1000 m from it")
    assert found.treated_share[0] == 0.0
    assert min(found.treated_share[1:]) >= 0.99


def test_all_dry_leaves_all():
    dry = tuple(replaced(spot, area=shapely.affinity.translate(spot.area, 2_000.0)) for spot in SPOTS)
    found = reply(hot_spots=dry)
    assert len(found.left) == 3
    assert not found.sorties
    assert found.makespan_s == 0.0
    assert found.joint_gap is None


def test_starts_ashore_have_straight_legs():
    fleet = (slave((-50.0, 300.0), length_m=5_000.0, recovery=(1_020.0, 300.0)),)
    request = replaced(REQUEST, vehicles=fleet)
    found = reply(request)
    require_sound(request, found)
    assert found.sorties[0].path.coords[:2] == [(-50.0, 300.0), (0.0, 300.0)]
    assert found.sorties[0].path.coords[-2:] == [(1_000.0, 300.0), (1_020.0, 300.0)]


def test_what_of_a_hot_spot_lies_on_land_is_told():
    found = reply(hot_spots=(HotSpot(name="shore", area=box(-50, 100, 50, 200), value=1.0),))
    assert "50% of hot spot 'shore' lies outside the free space" in found.warnings
    assert found.treated_share[0] >= 0.99


def test_the_better_of_clusters_and_joint_optimiser_is_taken():
    gaps = []
    for seed in range(6):
        free, rng = lake(seed, vertices=60), np.random.default_rng(seed)
        start = free.exterior.coords[0]
        fleet = [slave(start, name=f"{number}", speed_mps=1.0 + number) for number in range(3)]
        campaign = plan_campaign(hot_spots(rng, free, 8, 100.0), fleet, free, 40.0)
        first = campaign.schedule.first
        tours = [tour.targets for tour in first.best.tours]
        assert [journey.parts for journey in campaign.schedule.rounds[0]] == [tour for tour in tours if tour]
        assert first.best.rank <= min(first.clustered.assignment.rank, first.joint.rank)
        assert first.best_gap.relative <= 0.0
        gaps.append(first.gap.relative)
    assert max(gaps) > 0.0


def test_the_gap_to_the_joint_optimiser_is_that_of_the_sorties():
    assert reply().joint_gap <= 0.0


def test_the_faster_boat_saves_time():
    slow = reply(vehicles=(FLEET[0],))
    both = reply()
    assert both.makespan_s < slow.makespan_s


# ----------------------------------------------------------------------------- shares


@quick
@given(seed=st.integers(0, 10_000), masters=st.integers(2, 8), spread=st.floats(1.0, 5.0))
def test_shares_of_lakes_tile_them(seed, masters, spread):
    free, rng = lake(seed, vertices=60), np.random.default_rng(seed)
    lengths = 1e6 * rng.uniform(1.0, spread, masters)
    fleet = tuple(master((0.0, 0.0), name=f"{n}", length_m=length) for n, length in enumerate(lengths.tolist()))
    require_shares(AssignRequest(free=free, vehicles=fleet, share_free=True))


def require_shares(request: AssignRequest) -> Assignment:
    """Shares are connected, balanced, each its master's, and together the free space: ranges are ample."""
    found = reply(request)
    masters = [vehicle for vehicle in request.vehicles if vehicle.role == "master"]
    assert [share.vehicle for share in found.shares] == [vehicle.name for vehicle in masters]
    areas = [share.area for share in found.shares]
    assert all(isinstance(area, Polygon) and area.is_valid for area in areas)
    covered = shapely.union_all(areas)
    assert covered.symmetric_difference(request.free).area <= 1e-9 * request.free.area
    assert sum(area.area for area in areas) == pytest.approx(request.free.area, rel=1e-9)
    assert not found.dropped
    due = np.array([vehicle.length_m for vehicle in masters])
    deviation = np.abs(shapely.area(areas) / (request.free.area * due / due.sum()) - 1.0).max()
    assert found.imbalance == pytest.approx(deviation, abs=0.01)
    assert found.imbalance <= BALANCE
    return found


@needs_missions
@pytest.mark.parametrize("path", MISSIONS[::4], ids=lambda path: path.stem)
def test_real_lakes_are_shared_and_treated(path):
    mission = read_mission(path)
    site = Site.of(mission)
    free = contour(
        ContourRequest(
            outline=site.outline, zones=site.zones, safety_m=mission.safety_m, spacing_m=site.nominal_spacing_m
        ),
        discard,
    ).free
    rng, scale_m = np.random.default_rng(1), free.area**0.5
    masters = tuple(master(site.launch, name=f"master {n}", length_m=1e8 * (1 + n)) for n in range(3))
    slaves = tuple(slave(site.launch, name=f"slave {n}", length_m=4 * scale_m) for n in range(2))
    request = AssignRequest(
        free=free,
        vehicles=masters + slaves,
        share_free=True,
        hot_spots=hot_spots(rng, free, 8, scale_m / 30),
        swath_m=scale_m / 240,
    )
    require_sound(request, require_shares(request))


def test_one_master_has_all():
    found = reply(vehicles=FLEET, hot_spots=(), share_free=True)
    assert [share.area for share in found.shares] == [POND]
    assert found.imbalance == 0.0


def test_the_footprint_sets_the_mesh():
    fleet = tuple(master((0.0, 0.0), name=name) for name in "ab")
    layers: list[Layer] = []
    handle(AssignRequest(free=POND, vehicles=fleet, share_free=True, footprint_m=50.0), layers.append)
    mesh = next(layer for layer in layers if layer.name == "mesh")
    assert 40.0 < max(edge.length for edge in mesh.geometries) <= 50.0 + 1e-6


# ----------------------------------------------------------------------------- errors, layers, messages

OVERLAPPING = (*SPOTS, HotSpot(name="more", area=box(250, 400, 350, 450), value=1.0))


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"hot_spots": OVERLAPPING}, InvalidRequest, "hot spots 'north' and 'more' overlap in 2500 m2"),
        ({"hot_spots": SPOTS + SPOTS[:1]}, InvalidRequest, "hot_spots: has 'north' 2 times"),
        ({"hot_spots": (replaced(SPOTS[0], value=-1.0),)}, InvalidRequest, "value: of hot spot 'north' is -1"),
        ({"vehicles": FLEET[2:]}, InvalidRequest, "vehicles: has no slave"),
        ({"vehicles": FLEET[:2], "share_free": True}, InvalidRequest, "vehicles: has no master"),
        ({"swath_m": 1e-4}, InvalidRequest, r"swath_m: is 0.0001 m: hot spot 'north' would take"),
        (
            {"vehicles": (slave((-600.0, 0.0), length_m=1_100.0),)},
            Infeasible,
            "vehicle 'boat': start: lies 600 m outside the free space",
        ),
        (
            {"vehicles": (*FLEET, master((0.0, 0.0), name="four")), "share_free": True, "footprint_m": 0.1},
            InvalidRequest,
            r"footprint_m: is 0.1 m; for this water expected 2\.\d+ m or more",
        ),
    ],
)
def test_what_is_wrong_is_named(changes, error, message):
    with pytest.raises(error, match=message):
        reply(**changes)


def test_neighbours_that_share_a_border_do_not_overlap():
    halves = (
        HotSpot(name="west", area=box(100, 100, 200, 200), value=1.0),
        HotSpot(name="east", area=box(199.99, 100, 300, 200), value=1.0),
    )
    assert min(reply(hot_spots=halves).treated_share) >= 0.99


def test_every_step_is_shown():
    layers: list[Layer] = []
    fleet = (*FLEET, master((0.0, 0.0), name="four"))
    handle(replaced(REQUEST, vehicles=fleet, share_free=True), layers.append)
    assert {layer.stage for layer in layers} == {"assignment"}
    shown = {layer.name: layer for layer in layers}
    shares = ["mesh", "wavefront", "shares"]
    methods = [f"routes_{method}" for method in RouteMethod]
    sorties = ["sorties", "further", "figures"]
    assert list(shown) == [*shares, "hot_spots", "passes", "clusters", "routes", *methods, *sorties]
    assert shown["hot_spots"].labels == ("north: 2", "south: 1", "east: 3")
    assert max(shown["wavefront"].values) == 1.0
    assert len(shown["clusters"].geometries) == 3
    assert {label.split(":")[0] for label in shown["sorties"].labels} <= {"one", "two"}


def test_the_reply_survives_the_bus():
    request = replaced(REQUEST, share_free=True)
    found = handle(decode(encode(request), AssignRequest), discard)
    assert decode(encode(found), Assignment) == found


def test_the_same_request_gives_the_same_reply():
    free, rng = lake(3), np.random.default_rng(3)
    fleet = (
        *(slave((0.0, 0.0), name=name, length_m=6_000.0) for name in "ab"),
        *(master((0.0, 0.0), name=name) for name in "cd"),
    )
    request = AssignRequest(
        free=free, vehicles=fleet, share_free=True, hot_spots=hot_spots(rng, free, 8, 150.0), swath_m=30.0
    )
    assert encode(reply(request)) == encode(reply(decode(encode(request), AssignRequest)))


def test_nothing_is_done_unasked():
    assert reply(hot_spots=(), share_free=False) == Assignment()
