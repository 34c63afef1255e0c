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

from oxbow_path.improvement import improved, method_plan
from oxbow_path.refinement import Polyline
from oxbow_path.task import Display, MethodPlan, Task
from oxbow_path.walk.remainder import with_remainder
from oxbow_path.walk.spacing import Budget, best_trial, fitted
from oxbow_path.walk.trial import Pattern, Trial, Waters, walked
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
    plan = plan_watershed(task.waters, task.budget)
    for step, trial in enumerate(plan.trials):
        display.lines("iterations", [trial.path], step=step, labels=(f"spacing {trial.pattern.spacing_m:.1f} m",))
    display.lines("contours", plan.chosen.circuit.transects)
    display.lines("links", plan.chosen.circuit.links)
    path = Polyline.of(plan.chosen.path, task.waters.passable.free_and_rounding)
    return method_plan(improved(path, task, display), plan.chosen, plan.trials)


def plan_watershed(waters: Waters, budget: Budget) -> WatershedPlan:
    """The best of several reaches, each fitted to the length.

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
    trials = tuple(trial for reach in REACHES for trial in fitted(attempt, Pattern(first_m, reach, 0.0), budget))
    return WatershedPlan(with_remainder(best_trial(trials, waters, budget), waters, budget), trials)


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
    return walked(waters, pattern, circuit)
