"""Coverage from the border to the core by a closed, simple path."""

import math
from functools import partial

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon, box

from oxbow.contracts import PathRequest
from oxbow.errors import Infeasible
from oxbow.geometry.route.gate_routes import Routes
from oxbow.geometry.sweep import from_sweep
from oxbow.testing import nasty_polygons
from oxbow.wire.recording import Layer
from oxbow_path.conformance import require_conforming
from oxbow_path.task import Display, Task
from oxbow_path.walk.spacing import Budget, Fit
from oxbow_path.walk.trial import Waters
from oxbow_path.watershed import plan_watershed, watershed
from oxbow_path.watershed.contours import contour_tree
from tests.support.path_requests import lake, request

quick = settings(max_examples=6)


def waters_of(asked: PathRequest) -> Waters:
    return Task.of(asked, lambda: False).waters


def planned(asked: PathRequest) -> Fit:
    """A plan whose path was checked in the planar frame."""
    plan = plan_watershed(waters_of(asked), Budget(asked.length_m))
    back = partial(from_sweep, heading_rad=asked.decomposition.heading_rad)
    path = shapely.transform(plan.chosen.path, back)
    require_conforming(path, asked)
    ends = shapely.get_coordinates(path)[[0, -1]]
    assert ends == pytest.approx(np.array([asked.launch, asked.recovery]), abs=1e-6)
    return plan


@settings(quick, max_examples=4)
@given(seed=st.integers(0, 10_000), spacings=st.floats(10, 20), safety=st.sampled_from([0.0, 0.01]))
def test_paths_over_lakes_are_sound_and_use_their_length(seed, spacings, safety):
    asked = request(lake(seed), spacings=spacings, safety=safety)
    plan = planned(asked)
    assert plan.chosen.path.length >= 0.95 * asked.length_m


@pytest.mark.parametrize(
    "name", [name for name in sorted(nasty_polygons()) if "sliver" not in name and "grid" not in name][::3]
)
def test_paths_over_nasty_shapes_are_sound(name):
    planned(request(nasty_polygons()[name], spacings=8.0))


def test_the_refined_path_is_sound_and_shown():
    asked = request(lake(3), spacings=12.0)
    layers: list[Layer] = []
    steps = iter(range(6))
    task = Task.of(asked, lambda: next(steps, None) is None)
    plan = watershed(task, Display(layers.append, asked.decomposition.heading_rad))
    require_conforming(
        shapely.transform(plan.path, partial(from_sweep, heading_rad=asked.decomposition.heading_rad)), asked
    )
    assert plan.path.length >= 0.95 * asked.length_m
    assert {"iterations", "contours", "links", "refined"} <= {layer.name for layer in layers}


def test_launch_and_recovery_apart():
    planned(request(box(0, 0, 1000, 800), launch=(0.0, 100.0), recovery=(1000.0, 700.0)))


def test_a_length_that_is_too_short_is_told():
    with pytest.raises(Infeasible, match="length_m"):
        planned(request(box(0, 0, 5000, 60), spacings=2, launch=(0.0, 30.0), recovery=(5000.0, 30.0)))


def test_contours_stand_at_equal_depths_and_hang_together():
    water = box(0, 0, 1000, 1000).difference(box(400, 400, 500, 700))
    routes = Routes(water, 20.0)
    tree = contour_tree(water, routes, first_m=30.0, spacing_m=80.0)
    for contour in tree.transects:
        depth = shapely.distance(shapely.points(contour.coords), water.boundary)
        level = np.round((depth.mean() - 30.0) / 80.0)
        assert depth == pytest.approx(30.0 + 80.0 * level, abs=5.0)
    together = shapely.union_all(shapely.buffer([*tree.transects, *tree.links], 1e-6))
    assert isinstance(together, Polygon)
    assert water.covers(together)


def test_basins_behind_a_strait_are_joined():
    water = box(0, 0, 400, 400).union(box(400, 190, 600, 210)).union(box(600, 0, 1000, 400))
    tree = contour_tree(water, Routes(water, 10.0), first_m=30.0, spacing_m=80.0)
    together = shapely.union_all(shapely.buffer([*tree.transects, *tree.links], 1e-6))
    assert isinstance(together, Polygon)
    assert together.bounds[2] - together.bounds[0] > 900


def test_the_core_is_reached():
    """The path runs past every place of a square; the farthest is about half the spacing away."""
    asked = request(box(0, 0, 1000, 1000), spacings=20.0, safety=0.0)
    plan = planned(asked)
    distance = waters_of(asked).probe.distances(plan.chosen.path)
    assert distance.max() <= 1.6 * plan.chosen.pattern.spacing_m / 2 * math.sqrt(1.5)
