"""Assignment by clusters against the joint optimiser, and its time against the size of the fleet's work."""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import cache
from statistics import median

import numpy as np
import shapely
from scipy.spatial.distance import cdist
from shapely import Polygon

from oxbow.arrays import FloatArray
from oxbow.contracts import Vehicle
from oxbow.geometry.route import RouteMethod, Router, make_router
from oxbow.site.site import Site
from oxbow_assignment.targets.assign import Clustering, ClusterMethod, assign, cluster_paths
from oxbow_assignment.targets.assignment import TargetAssignment, assignment_of
from oxbow_assignment.targets.joint import gap_to, is_available, optimise
from oxbow_assignment.targets.problem import Objective, Problem
from tests.bench.lakes import lake
from tests.bench.results import Figure, Goal, Section, middle

__all__ = ["measure"]

TARGETS, VEHICLES = 60, 4

RANGES = {"ample": 1.6, "scarce": 0.9}
"""Each vehicle's range, as a multiple of its share of a good tour of all targets."""

TOUR_CONSTANT = 0.7124
"""A good tour of n targets in an area A is about this times sqrt(n A) long (Johnson and McGeoch, 1997)."""

HASTY = 20
"""Iterations without improvement after which the joint optimiser is as quick as it can be asked to be."""

SIZES = ((100, 5), (300, 10), (1_000, 20))


def measure() -> Iterator[Section]:
    """Two tables: against the joint optimiser, and against size."""
    if is_available():
        rows = [
            _comparison(Objective.TOTAL, "ample", 50, patience=2_000),
            _comparison(Objective.TOTAL, "scarce", 20, patience=2_000),
            _comparison(Objective.MAKESPAN, "ample", 10, patience=500),
        ]
        yield Section(
            f"Clusters against the joint optimiser: {TARGETS} targets, {VEHICLES} vehicles, a lake with islands",
            rows,
            goals=[
                Goal("median gap in the total", float(rows[0]["gap %"]), " %", at_most=15),
                Goal("times faster", float(rows[0]["times faster"]), at_least=20),
            ],
            note="medians of gaps to the joint optimiser in scenes in which both serve the same (`compared`);"
            f" `report`: no insertions or exchanges; `hasty`: the joint optimiser with {HASTY} idle iterations",
        )
    sizes = [_size(targets, vehicles, clustering) for targets, vehicles in SIZES for clustering in _clusterings()]
    yield Section(
        "Time of assignment by clusters (open water)",
        sizes,
        goals=[
            Goal(
                f"{SIZES[-1][0]} targets and {SIZES[-1][1]} vehicles",
                max(float(row["s"]) for row in sizes if row["targets"] == SIZES[-1][0]),
                " s",
                at_most=10,
            )
        ],
    )


def _comparison(objective: Objective, ranges: str, scenes: int, *, patience: int) -> dict[str, Figure]:
    rows = [_scene(objective, RANGES[ranges], seed, patience) for seed in range(scenes)]
    gaps = [gap for row in rows if not isinstance(gap := row["gap %"], str)]
    return {
        "objective": objective.value,
        "range": ranges,
        "scenes": scenes,
        "compared": len(gaps),
        "report %": _middle(rows, "report %"),
        "gap %": _middle(rows, "gap %"),
        "worst %": max(gaps, default=""),
        "hasty %": _middle(rows, "hasty %"),
        "missed": float(np.mean([float(row["missed"]) for row in rows])),
        "joint missed": float(np.mean([float(row["joint missed"]) for row in rows])),
        "s": middle(rows, "s"),
        "joint s": middle(rows, "joint s"),
        "hasty s": middle(rows, "hasty s"),
        "times faster": median(float(row["joint s"]) / float(row["s"]) for row in rows),
    }


def _scene(objective: Objective, share: float, seed: int, patience: int) -> dict[str, Figure]:
    problem = _problem_on_a_lake(objective, share, seed)
    started = time.perf_counter()
    found = assign(problem)
    clustered_at = time.perf_counter()
    joint = optimise(problem, patience=patience)
    joint_at = time.perf_counter()
    hasty = optimise(problem, patience=HASTY)
    hasty_at = time.perf_counter()
    assert found.clusters is not None
    report = assignment_of(problem, cluster_paths(problem, found.targets, found.clusters, found.owners))
    return {
        "report %": _gap(report, joint),
        "gap %": _gap(found.assignment, joint),
        "hasty %": _gap(hasty, joint),
        "missed": len(found.assignment.unserved),
        "joint missed": len(joint.unserved),
        "s": clustered_at - started,
        "joint s": joint_at - clustered_at,
        "hasty s": hasty_at - joint_at,
    }


def _gap(assignment: TargetAssignment, joint: TargetAssignment) -> Figure:
    """In %; nothing where one serves more than the other."""
    gap = gap_to(assignment, joint).relative
    return "" if gap is None else 100.0 * gap


def _middle(rows: list[dict[str, Figure]], column: str) -> Figure:
    figures = [figure for row in rows if not isinstance(figure := row[column], str)]
    return median(figures) if figures else ""


def _problem_on_a_lake(objective: Objective, share: float, seed: int) -> Problem:
    water, router = _lake()
    random = np.random.default_rng(seed)
    places = _places(water, TARGETS + VEHICLES, random)
    length_m = share * TOUR_CONSTANT * np.sqrt(TARGETS * water.area) / VEHICLES
    return _problem(places, VEHICLES, router.distances(np.vstack([places, places[TARGETS:]])), length_m, objective)


@cache
def _lake() -> tuple[Polygon, Router]:
    site = Site.of(lake(400, 8))
    water: Polygon = max(
        shapely.get_parts(site.outline.difference(shapely.union_all(site.zones))), key=shapely.area
    )
    return water, make_router(RouteMethod.VISIBILITY, water)


def _places(water: Polygon, count: int, random: np.random.Generator) -> FloatArray:
    low, high = np.reshape(water.bounds, (2, 2))
    places = random.uniform(low, high, (20 * count, 2))
    return places[shapely.contains_xy(water, places)][:count]


def _problem(
    places: FloatArray, vehicles: int, distances: FloatArray, length_m: float, objective: Objective
) -> Problem:
    fleet = tuple(
        Vehicle(name=f"boat {number}", length_m=length_m, start=(x, y), recovery=(x, y))
        for number, (x, y) in enumerate(places[-vehicles:].tolist())
    )
    return Problem(fleet, distances, objective)


def _clusterings() -> tuple[Clustering, ...]:
    return (
        Clustering(),
        Clustering(method=ClusterMethod.FUZZY_C_MEANS),
        Clustering(method=ClusterMethod.RADIUS, radius_m=600.0),
    )


def _size(targets: int, vehicles: int, clustering: Clustering) -> dict[str, Figure]:
    places = np.random.default_rng(0).uniform(0.0, 5_000.0, (targets + vehicles, 2))
    points = np.vstack([places, places[targets:]])
    length_m = RANGES["ample"] * TOUR_CONSTANT * np.sqrt(targets) * 5_000.0 / vehicles
    problem = _problem(places, vehicles, cdist(points, points), length_m, Objective.TOTAL)
    started = time.perf_counter()
    found = assign(problem, clustering)
    seconds = time.perf_counter() - started
    assert found.clusters is not None
    return {
        "clustering": clustering.method.value,
        "targets": targets,
        "vehicles": vehicles,
        "clusters": found.clusters.count,
        "total km": found.assignment.total_length_m / 1_000.0,
        "missed": len(found.assignment.unserved),
        "s": seconds,
    }
