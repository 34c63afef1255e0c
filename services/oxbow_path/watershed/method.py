"""The Watershed method: a closed, simple path from the border to the core and back.

Balampanis, Maza and Ollero 2016, cover an area from its border to its core, one level after another: an inward
spiral that passes triangles again and crosses itself where levels part or islands stand. Here the levels are
contours of the distance to the shore, two spacings apart; the tree that they and their links make is walked
round, as that of the Transect method (`oxbow_path.walk`). One side of a contour is travelled inwards, the other on
the way back: the path ends where it began, is simple, and stays inside by construction.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from oxbow_path.improvement import improved_line, method_plan
from oxbow_path.refinement import Polyline
from oxbow_path.task import Display, MethodPlan, Task
from oxbow_path.walk.remainder import with_remainder
from oxbow_path.walk.spacing import Budget, Fit, fit_spacing
from oxbow_path.walk.trial import Pattern, Trial, Waters, walk_round_tree
from oxbow_path.watershed.contours import contour_tree

__all__ = ["plan_watershed", "try_contours", "watershed"]

FIRST_SPACING = 1.15
"""The first spacing tried, in nominal spacings: ways in and branches cost about as much."""


def watershed(task: Task, display: Display) -> MethodPlan:
    """Plan a path along contours of the distance to the shore, and refine it.

    Parameters
    ----------
    task
        The request made ready.
    display
        Shows how the path came about.

    Returns
    -------
    MethodPlan
        Its spacing is that of the chosen pattern.

    Raises
    ------
    Infeasible
        No path that was tried is short enough.
    """
    fit = plan_watershed(task.waters, task.budget)
    for step, trial in enumerate(fit.trials):
        display.lines("iterations", [trial.path], step=step, labels=(f"spacing {trial.pattern.spacing_m:.1f} m",))
    display.lines("contours", fit.chosen.circuit.transects)
    display.lines("links", fit.chosen.circuit.links)
    path = Polyline.of(fit.chosen.path, task.waters.passable.free_and_rounding)
    return method_plan(improved_line(path, task, display), fit)


def plan_watershed(waters: Waters, budget: Budget) -> Fit:
    """The walk round contours, at the spacing that uses the length best.

    Parameters
    ----------
    waters
        The water, and how launch and recovery points are reached.
    budget
        The longest path, and the least spacing.

    Returns
    -------
    Fit
        The chosen trial has its spurs.

    Raises
    ------
    Infeasible
        Even the shortest way from launch to recovery is longer than the vehicle can go.
    """
    attempt = partial(try_contours, waters)
    fit = fit_spacing(attempt, FIRST_SPACING * waters.spacing_m, budget, widest_m=waters.widest_m)
    return replace(fit, chosen=with_remainder(fit.chosen, waters, budget))


def try_contours(waters: Waters, pattern: Pattern) -> Trial:
    """Build the path for one pattern.

    Contours stand two spacings apart, so that the legs on their two sides stand one spacing apart.

    Parameters
    ----------
    waters
        The water, and how launch and recovery points are reached.
    pattern
        The spacing; its phase does not matter.

    Returns
    -------
    Trial
        Longer than the budget, perhaps: that is for the caller to judge.
    """
    circuit = contour_tree(
        waters.free,
        waters.routes,
        first_m=pattern.trim_m + pattern.half_width_m,
        spacing_m=2 * pattern.spacing_m,
    )
    return walk_round_tree(waters, pattern, circuit)
