"""The Watershed method: a closed, simple path from the border to the core and back.

Balampanis, Maza and Ollero 2016, cover an area from its border to its core, one level after another: an inward
spiral that passes triangles again and crosses itself where levels part or islands stand. Here the levels are
contours of the distance to the shore, two spacings apart; the tree that they and their links make is walked
round, as that of the Transect method (`oxbow_path.walk`). One side of a contour is travelled inwards, the other on
the way back: the path ends where it began, is simple, and stays inside by construction.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from shapely import Polygon

from oxbow.contracts import SpacingStep
from oxbow.errors import Infeasible
from oxbow_path.circuit import Circuit
from oxbow_path.gaps import reach_gaps
from oxbow_path.planner import ENOUGH, _score
from oxbow_path.refinement import Polyline, refined
from oxbow_path.remainder import with_remainder
from oxbow_path.spacing import Budget, fitted
from oxbow_path.task import Display, MethodPlan, Task
from oxbow_path.transect import (
    STRAIGHTENING,
    Pattern,
    Trial,
    Waters,
    _accessible,
    _started,
    _straightened,
    finished,
    touches_entries,
)
from oxbow_path.walk import Brush, Walk, simply_connected
from oxbow_path.watershed.contours import contour_tree

__all__ = ["WatershedPlan", "plan_watershed", "try_contours", "watershed"]

REACHES = (1.5, 1.3, 1.8)
FIRST_SPACING = 1.15
"""The first spacing tried, in nominal spacings: ways in and branches cost about as much."""


@dataclass(frozen=True)
class WatershedPlan:
    """The chosen trial and all others, in the order of trying; sweep frame."""

    chosen: Trial
    trials: tuple[Trial, ...]


def watershed(task: Task, display: Display) -> MethodPlan:
    """Plan a path along contours of the distance to the shore, and refine it.

    Raises
    ------
    Infeasible
        No path that was tried is short enough.
    """
    plan = plan_watershed(task.waters, Budget(task.length_m, ENOUGH * task.length_m, task.least_spacing_m))
    for step, trial in enumerate(plan.trials):
        display.lines("iterations", [trial.path], step=step, labels=(f"spacing {trial.pattern.spacing_m:.1f} m",))
    chosen = plan.chosen
    display.lines("contours", chosen.circuit.transects)
    display.lines("links", chosen.circuit.links)
    path = refined(
        Polyline.of(chosen.path, task.waters.passable.free_and_rounding),
        task.waters.free,
        task.samples,
        length_m=max(chosen.length_m, task.useful_length_m),
        spacing_m=task.spacing_m,
        stop=task.stop,
        watch=display.refinement,
    )
    steps = tuple(SpacingStep(spacing_m=trial.pattern.spacing_m, length_m=trial.length_m) for trial in plan.trials)
    return MethodPlan(path, chosen.pattern.spacing_m, chosen.pattern.reach_m, steps)


def plan_watershed(waters: Waters, budget: Budget) -> WatershedPlan:
    """Plan a Watershed path.

    Parameters
    ----------
    waters
        Where the path may run, and how launch and recovery points are reached.
    budget
        How long the path may be, and how long it should be.

    Raises
    ------
    Infeasible
        No path that was tried is short enough.
    """
    first_m = FIRST_SPACING * waters.spacing_m
    attempt = partial(try_contours, waters)
    trials = [trial for reach in REACHES for trial in fitted(attempt, Pattern(first_m, reach, 0.0), budget)]
    fitting = [trial for trial in trials if budget.fits(trial.length_m)]
    if not fitting:
        shortest_m = min(trial.length_m for trial in trials)
        raise Infeasible(
            f"is {budget.most_m:.0f} m; the shortest path from launch to recovery is {shortest_m:.0f} m",
            "Master_length",
        )
    chosen = min(fitting, key=lambda trial: _score(trial, waters, budget))
    if chosen.pattern.spacing_m > budget.least_spacing_m:
        chosen = with_remainder(chosen, waters, budget)
    return WatershedPlan(chosen, tuple(trials))


def try_contours(waters: Waters, pattern: Pattern) -> Trial:
    """Build the path for one pattern.

    Contours stand two spacings apart, so that the legs on their two sides stand one spacing apart.
    """
    circuit = contour_tree(
        waters.free,
        waters.routes,
        first_m=pattern.trim_m + pattern.half_width_m,
        spacing_m=2 * pattern.spacing_m,
    )
    return _walked(waters, pattern, circuit)


def _walked(waters: Waters, pattern: Pattern, circuit: Circuit) -> Trial:
    brush = Brush(waters.free, pattern.half_width_m, pattern.trim_m)
    connected = partial(
        simply_connected, free=waters.free, probe=waters.probe, cut_width_m=pattern.cut_m, reach_m=pattern.reach_m
    )
    walk = connected(_accessible(_started(waters, circuit, brush), waters, brush))
    walk = reach_gaps(walk, brush, waters.probe, waters.routes, reach_m=pattern.reach_m, cut_width_m=pattern.cut_m)
    region = _straightened(walk.region, waters, STRAIGHTENING * pattern.spacing_m)
    region = connected(_accessible(region, waters, brush)).region
    if not touches_entries(region, waters):
        region = Polygon(_accessible(region, waters, brush).exterior)
    return finished(waters, pattern, circuit, Walk(region, walk.cuts, walk.enclosed))
