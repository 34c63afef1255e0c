import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st
from msgspec import structs
from shapely import Point, Polygon, affinity, box

from oxbow.contracts import ContourRequest, FreeSpace
from oxbow.errors import Infeasible
from oxbow.testing import nasty_polygons
from oxbow.wire.codec import encode
from oxbow.wire.recording import discard
from oxbow_contour.free_space import default_tolerance_m
from oxbow_contour.service import handle
from oxbow_contour.verification import is_safe
from oxbow_contour.water import true_water

SQUARE = box(0, 0, 100, 100)


def star(rng: np.random.Generator, centre, radius: float, count: int, roughness: float) -> Polygon:
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    radii = radius * (1 + roughness * rng.uniform(-1, 1, count))
    return Polygon(np.asarray(centre) + radii[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]))


def ragged_site(seed: int, count: int, roughness: float, zones: int) -> tuple[Polygon, tuple[Polygon, ...]]:
    """A ragged outline and zones that may overlap, cross the outline or lie outside."""
    rng = np.random.default_rng(seed)
    outline = star(rng, (0, 0), 100, count, roughness)
    return outline, tuple(
        star(rng, rng.uniform(-110, 110, 2), rng.uniform(1, 30), 12, roughness) for _ in range(zones)
    )


sites = st.builds(
    ragged_site,
    st.integers(0, 2**32 - 1),
    st.integers(6, 250),
    st.sampled_from([0.0, 0.001, 0.05, 0.4, 0.9]),
    st.integers(0, 10),
)


def free_space(outline: Polygon, zones=(), safety_m=0.0, spacing_m=10.0, tolerance_m=None) -> FreeSpace:
    return handle(
        ContourRequest(
            outline=outline, zones=tuple(zones), safety_m=safety_m, spacing_m=spacing_m, tolerance_m=tolerance_m
        ),
        discard,
    )


def assert_safe(space: FreeSpace, outline: Polygon, zones, safety_m: float) -> None:
    water = outline.difference(shapely.union_all(list(zones)))
    assert space.free.is_valid
    assert water.contains(space.free)
    distance_m = space.free.boundary.distance(water.boundary)
    assert distance_m > 0
    assert distance_m >= safety_m * (1 - 1e-9)


@settings(max_examples=100)
@given(
    sites,
    st.sampled_from([0.0, 0.01, 1.0, 5.0]),
    st.sampled_from([1.0, 10.0, 100.0]),
    st.sampled_from([None, 0.0, 0.1, 2.0, 30.0, 1e5]),
)
def test_free_space_is_inside_the_true_outline_less_the_safety_distance(site, safety_m, spacing_m, tolerance_m):
    outline, zones = site
    try:
        space = free_space(outline, zones, safety_m, spacing_m, tolerance_m)
    except Infeasible:
        water = outline.difference(shapely.union_all(list(zones)))
        assert water.buffer(-1.004 * safety_m - 1e-6).is_empty
        return
    assert_safe(space, outline, zones, safety_m)
    assert space.water.contains(space.free)


@settings(max_examples=40)
@given(sites, st.sampled_from([0.5, 3.0]))
@example(ragged_site(0, 225, 0.9, 0), 3.0)
@example(ragged_site(13, 82, 0.0, 5), 3.0)
def test_by_default_only_a_strip_along_the_shore_is_lost(site, safety_m):
    outline, zones = site
    spacing_m = 10.0
    water = outline.difference(shapely.union_all(list(zones)))
    # Straits that the safety distance leaves open by less than the finest tolerance may be taken for closed.
    parts = shapely.get_parts(water.buffer(-safety_m - spacing_m / 500, quad_segs=32))
    exact = max(parts, key=shapely.area, default=Polygon())
    if exact.area < spacing_m**2:
        return
    free = free_space(outline, zones, safety_m, spacing_m).free
    assert shapely.distance(free, shapely.points(shapely.get_coordinates(exact))).max() <= spacing_m / 4


@pytest.mark.parametrize("name", nasty_polygons())
@pytest.mark.parametrize("tolerance_m", [None, 0.0, 50.0])
@pytest.mark.parametrize("safety_m", [0.0, 1.0])
def test_nasty_sites(name, tolerance_m, safety_m):
    water = nasty_polygons()[name]
    outline, zones = Polygon(water.exterior), [Polygon(ring) for ring in water.interiors]
    try:
        space = free_space(outline, zones, safety_m, 20.0, tolerance_m)
    except Infeasible:
        assert shapely.buffer(water, -1.004 * safety_m).is_empty
        return
    assert_safe(space, outline, zones, safety_m)


@settings(max_examples=40)
@given(sites, st.floats(0, 360), st.sampled_from([0.01, 1.0, 1000.0]), st.sampled_from([0.0, 1e3, 1e4]))
def test_moving_turning_and_scaling_a_site_does_the_same_to_its_free_space(site, degrees, scale, shift):
    def moved(shape: Polygon) -> Polygon:
        turned = affinity.rotate(shape, degrees, origin=(0, 0))
        return affinity.translate(
            affinity.scale(turned, scale, scale, origin=(0, 0)), shift * scale, -shift * scale
        )

    outline, zones = site
    try:
        here = free_space(outline, zones, 1.0, 10.0)
    except Infeasible:
        return
    there = free_space(moved(outline), [moved(zone) for zone in zones], scale, 10.0 * scale)
    # Rounding decides ties, so that a few vertices differ: by the tolerance and a round corner's excess at most.
    displaced_m = 2 * max(here.tolerance_m * scale, there.tolerance_m) + 0.003 * scale
    assert moved(here.free).symmetric_difference(there.free).area <= displaced_m * there.free.length


@settings(max_examples=20)
@given(sites)
def test_the_same_site_gives_the_same_bytes(site):
    def reply() -> bytes:
        try:
            return encode(free_space(*site, 1.0, 5.0))
        except Infeasible as error:
            return error.message.encode()

    assert reply() == reply()


@settings(max_examples=40)
@given(sites, st.sampled_from([20.0, 60.0, 1000.0]))
def test_the_safety_distance_named_when_infeasible_leaves_water(site, safety_m):
    outline, zones = site
    try:
        free_space(outline, zones, safety_m, 20.0)
    except Infeasible as error:
        if error.where != "safety_m":
            return
        assert f"{safety_m:g}" in error.message
        named_m = float(error.message.split("such as ")[1].split(" m")[0])
        assert 0 < named_m < safety_m
        assert free_space(outline, zones, named_m, 20.0).free.area > 0


def test_the_safety_distance_named_is_nearly_the_largest():
    with pytest.raises(Infeasible, match=r"such as 49\.9") as raised:
        free_space(SQUARE, safety_m=51.0)
    assert raised.value.where == "safety_m"


@pytest.mark.parametrize(
    "zones", [[box(-1, -1, 101, 101)], [SQUARE], [box(0, 0, 60, 100), box(50, 0, 100, 100)]], ids=str
)
def test_zones_that_cover_everything_are_infeasible(zones):
    with pytest.raises(Infeasible, match="zones"):
        free_space(SQUARE, zones)


ISLAND = box(40, 40, 60, 60)


@pytest.mark.parametrize(
    ("zones", "area_m2", "islands"),
    [
        ([], 98**2, 0),
        ([ISLAND], 98**2 - 22**2, 1),
        ([ISLAND, ISLAND], 98**2 - 22**2, 1),
        ([ISLAND, box(45, 45, 50, 50)], 98**2 - 22**2, 1),
        ([ISLAND, box(50, 40, 80, 60)], 98**2 - 42 * 22, 1),
        ([ISLAND, box(61, 40, 70, 60)], 98**2 - 32 * 22, 1),
        ([ISLAND, box(200, 0, 300, 100)], 98**2 - 22**2, 1),
        ([box(-10, -10, 110, 20)], 98 * 78, 0),
        ([box(100, 0, 200, 100)], 98**2, 0),
        ([box(0, 40, 20, 60)], 98**2 - 20 * 22, 0),
        ([box(1.5, 40, 20, 60)], 98**2 - 20 * 22, 0),
        ([Polygon([(30, 0), (50, 30), (70, 0)])], None, 0),
        ([Polygon([(30, 50), (50, 100), (70, 50)])], None, 0),
        ([box(-10, 40, 110, 60)], 98 * 38, 0),
    ],
    ids=[
        "none",
        "island",
        "twice the same",
        "nested",
        "overlapping",
        "nearly touching",
        "one outside",
        "across the border",
        "along the border from outside",
        "along the border from inside",
        "near the border",
        "an edge on the border",
        "a point on the border",
        "splitting",
    ],
)
def test_zones(zones, area_m2, islands):
    space = free_space(SQUARE, zones, safety_m=1.0, tolerance_m=0.0)
    assert_safe(space, SQUARE, zones, 1.0)
    assert len(space.free.interiors) == islands
    if area_m2 is not None:
        assert space.free.area == pytest.approx(area_m2, rel=2e-3)


def test_islands_inside_the_outline_are_left_as_they_are():
    (water,) = true_water(SQUARE, [ISLAND])
    assert water.interiors[0].equals(ISLAND.exterior)
    assert shapely.get_num_coordinates(water) == 10


def test_islands_that_close_a_ring_corner_to_corner_cut_off_the_water_inside():
    zones = [box(30, 30, 50, 50), box(50, 50, 70, 70), box(30, 70, 50, 90), box(10, 50, 30, 70)]
    water = true_water(SQUARE, zones)
    assert sorted(round(part.area) for part in water) == [400, 10_000 - 5 * 400]


def test_parts_not_connected_are_dropped_and_listed():
    straits = [box(0, 60, 47, 62), box(53, 60, 100, 62), box(0, 20, 100, 22)]
    space = free_space(SQUARE, straits, safety_m=4.0, spacing_m=10.0)
    assert_safe(space, SQUARE, straits, 4.0)
    assert [part.reason for part in space.dropped] == [
        "in water that is not connected to that of the launch point",
        "not connected to the largest part at this safety distance",
    ]
    assert [part.area_m2 for part in space.dropped] == [
        pytest.approx(100 * 20),
        pytest.approx(92 * 30, rel=0.02),
    ]
    for part in space.dropped:
        assert part.area_m2 == part.outline.area
        assert part.outline.contains(Point(part.place))
    assert any("dropped 2 parts, " in warning for warning in space.warnings)


def test_a_narrow_strait_is_not_closed_by_simplification():
    # 2.2 m of strait at a safety distance of 1 m: the tolerance asked for alone would close it.
    rough = [(x, 51.1 + 0.05 * (x % 2)) for x in range(40, 61)]
    lake = Polygon(
        [
            (0, 0),
            (40, 0),
            (40, 48.9),
            (60, 48.9),
            (60, 0),
            (100, 0),
            (100, 100),
            (60, 100),
            *rough[::-1],
            (40, 100),
            (0, 100),
        ]
    )
    space = free_space(lake, safety_m=1.0, spacing_m=5.0, tolerance_m=1.0)
    assert not space.dropped
    assert space.tolerance_m < 0.1
    assert "closed an arm" in space.warnings[0]
    assert_safe(space, lake, [], 1.0)


def test_a_dead_end_arm_is_not_lost_to_simplification():
    lake = shapely.union_all([SQUARE, box(100, 50, 300, 52.2)])
    space = free_space(lake, safety_m=1.0, spacing_m=5.0, tolerance_m=0.5)
    assert space.free.bounds[2] > 298


def test_a_tolerance_larger_than_the_lake_is_reduced():
    space = free_space(Point(0, 0).buffer(50), safety_m=1.0, spacing_m=5.0, tolerance_m=1e6)
    assert space.tolerance_m < 1
    assert space.free.area > 0.95 * np.pi * 49**2
    assert space.warnings


def test_without_safety_the_free_space_is_strictly_inside():
    for tolerance_m in (None, 0.0):
        space = free_space(SQUARE, [ISLAND], safety_m=0.0, tolerance_m=tolerance_m)
        assert_safe(space, SQUARE, [ISLAND], 0.0)
        assert space.free.area == pytest.approx(9600, rel=0.01)


def test_water_thinner_than_rounding_is_infeasible():
    with pytest.raises(Infeasible, match="rounding"):
        free_space(affinity.translate(box(0, 0, 100, 1e-5), 0, 3e5), safety_m=0.0)


def test_far_from_the_origin():
    outline = affinity.translate(star(np.random.default_rng(0), (0, 0), 100, 500, 0.3), 3e5, -3e5)
    assert_safe(free_space(outline, safety_m=2.0), outline, [], 2.0)


def test_default_tolerance_follows_safety_and_spacing():
    assert default_tolerance_m(0.0, 100.0) == 0.5
    assert default_tolerance_m(15.0, 100.0) == 0.75
    assert default_tolerance_m(500.0, 100.0) == 1.0


def test_hundreds_of_thousands_of_points():
    count = 250_000
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    waves = sum(np.sin(k * angle + k) / k for k in (3, 8, 21, 55, 144, 377))
    radius = 10_000 + 1000 * waves + 0.5 * np.random.default_rng(0).uniform(-1, 1, count)
    outline = Polygon(radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]))
    island = Point(0, 0).buffer(700, quad_segs=1000)
    space = free_space(outline, [island], safety_m=20.0, spacing_m=300.0)
    assert space.compression > 100
    assert len(space.free.interiors) == 1
    assert is_safe(space.free, true_water(outline, [island]), 20.0)
    assert space.free.area > 0.95 * (outline.area - island.area)


def test_very_long_contours_are_simplified_more_coarsely():
    outline = star(np.random.default_rng(0), (0, 0), 1000, 80_000, 0.01)
    space = free_space(outline, safety_m=5.0, spacing_m=200.0)
    assert space.tolerance_m > default_tolerance_m(5.0, 200.0)
    assert "too many points" in space.warnings[0]
    assert is_safe(space.free, [outline], 5.0)
    assert space.free.area > 0.93 * np.pi * 995**2


@pytest.mark.parametrize("safety_m", [0.2499, 249.9])
def test_a_safety_distance_just_below_half_the_width_leaves_the_strip_that_is_there(safety_m):
    water = box(0, 0, 2.0016 * safety_m, 2 * safety_m + 300)
    space = free_space(water, safety_m=safety_m, spacing_m=20.0)
    assert_safe(space, water, (), safety_m)
    assert space.free.bounds[3] - space.free.bounds[1] == pytest.approx(300, abs=0.01 * safety_m)


def test_too_large_a_safety_distance_is_refused_with_one_that_leaves_water():
    water = box(0, 0, 500.1, 800)
    with pytest.raises(Infeasible, match=r"251 m, which leaves no free water; .* such as 250 m") as caught:
        free_space(water, safety_m=251)
    assert caught.value.where == "safety_m"
    assert free_space(water, safety_m=250).free.area > 0


def test_a_seam_of_free_water_is_refused_with_a_safety_distance_that_leaves_more():
    """Rounding decides where in it there is any, and no boat keeps to the middle so well."""
    asked = ContourRequest(
        outline=box(0, 0, 10, 600), safety_m=4.999, spacing_m=10.0, least_width_m=0.1, places=((5.0, 0.0),)
    )
    with pytest.raises(
        Infeasible, match=r"4.999 m, which leaves no free water wider than .* such as 4.948"
    ) as caught:
        handle(asked, discard)
    assert caught.value.where == "safety_m"
    assert handle(structs.replace(asked, safety_m=4.948), discard).free.area == pytest.approx(61, rel=0.05)


def test_a_wide_spot_is_no_water_to_be_reached_from_far_up_a_narrow_canal():
    canal = box(0, 0, 400, 10).union(box(382, 9, 388, 11.5))
    near, far = ((375.0, 5.0),), ((5.0, 5.0),)
    asked = ContourRequest(outline=canal, safety_m=5.0, spacing_m=10.0, least_width_m=0.1, places=near)
    assert handle(asked, discard).free.area < 2
    with pytest.raises(Infeasible, match=r"from the only free water.* than 10 m, twice `safety_m`") as caught:
        handle(structs.replace(asked, places=far), discard)
    assert caught.value.where == "places[0]"
