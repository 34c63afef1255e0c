"""The Transect planner: several patterns, each fitted to the length, and the best path of all."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
import shapely

from oxbow.contracts import SpacingStep
from oxbow.errors import Infeasible
from oxbow_path.refinement import Polyline, refined
from oxbow_path.remainder import with_remainder
from oxbow_path.show import show_transects
from oxbow_path.spacing import Budget, fitted
from oxbow_path.task import Display, MethodPlan, Task
from oxbow_path.transect import Pattern, Trial, Waters, try_pattern

__all__ = ["TransectPlan", "plan_transects", "transects"]

ENOUGH = 0.97
"""Share of the longest length that a path should use at least."""

UPRIGHT = 0.02
"""Slope at most, of what counts as a transect."""

FIRST_SPACING = 1.15
"""The first spacing tried, as a multiple of area / length: turns and ways back cost about as much."""

REACHES = (1.5, 1.3, 1.8)
PHASES = (0.25, 0.75)
REACH_FOR_SPACING = 0.6
"""The fitting spacing falls about as the reach to this power."""

MANY_POINTS = 80_000
"""With more probe points than these, one pattern is fitted and not several."""


@dataclass(frozen=True)
class TransectPlan:
    """The chosen trial and all others, in the order of trying; sweep frame."""

    waters: Waters
    chosen: Trial
    trials: tuple[Trial, ...]


def transects(task: Task, display: Display) -> MethodPlan:
    """Plan a path of parallel transects, and refine it: transects slide and turn a little, all else moves freely.

    Raises
    ------
    Infeasible
        Even the shortest way from launch to recovery is longer than the vehicle can go.
    """
    plan = plan_transects(task)
    show_transects(plan, display)
    chosen, spacing_m = plan.chosen, plan.chosen.pattern.spacing_m
    path = refined(
        _polyline(chosen, task),
        task.waters.free,
        task.samples,
        length_m=max(chosen.length_m, task.useful_length_m),
        spacing_m=task.spacing_m,
        stop=task.stop,
        watch=display.refinement,
    )
    steps = tuple(SpacingStep(spacing_m=trial.pattern.spacing_m, length_m=trial.length_m) for trial in plan.trials)
    return MethodPlan(path, spacing_m, chosen.pattern.reach_m, steps)


def plan_transects(task: Task) -> TransectPlan:
    """The best of several patterns, each fitted to the length."""
    waters = task.waters
    budget = Budget(task.length_m, ENOUGH * task.length_m, task.least_spacing_m)
    trials = tuple(_trials(waters, budget, FIRST_SPACING * task.spacing_m))
    fitting = [trial for trial in trials if budget.fits(trial.length_m)]
    if not fitting:
        shortest = min(trial.length_m for trial in trials)
        raise Infeasible(
            f"is {task.request.length_m:.0f} m; the shortest path from launch to recovery is {shortest:.0f} m",
            "Master_length",
        )
    chosen = min(fitting, key=lambda trial: _score(trial, waters, budget))
    if chosen.pattern.spacing_m > task.least_spacing_m:
        chosen = with_remainder(chosen, waters, budget)
    return TransectPlan(waters, chosen, trials)


def _polyline(trial: Trial, task: Task) -> Polyline:
    """The path, its transects rigid: they stand upright in the sweep frame."""
    across, along = np.abs(np.diff(shapely.get_coordinates(trial.path), axis=0)).T
    rigid = (across < UPRIGHT * along) & (along > trial.pattern.spacing_m)
    return Polyline.of(trial.path, task.waters.passable.free_and_rounding, rigid)


def _trials(waters: Waters, budget: Budget, first_spacing_m: float) -> Iterator[Trial]:
    """Fit the middle reach at every phase, then the other reaches at the phase that did best.

    Very long paths are fitted once. Where nothing fits, the last trial has neither transects nor branches.
    """
    attempt = partial(try_pattern, waters)
    few = len(waters.probe.points) > MANY_POINTS
    fits = []
    for phase in PHASES[:1] if few else PHASES:
        fits.append(fitted(attempt, Pattern(first_spacing_m, REACHES[0], phase), budget))
        first_spacing_m = fits[-1][-1].pattern.spacing_m
        yield from fits[-1]
    best = min((fit[-1] for fit in fits), key=lambda trial: _score(trial, waters, budget))
    for reach in () if few else REACHES[1:]:
        # Less reach asks for more branches, which a wider spacing has to pay for.
        spacing_m = best.pattern.spacing_m * float((REACHES[0] / reach) ** REACH_FOR_SPACING)
        fits.append(fitted(attempt, Pattern(spacing_m, reach, best.pattern.phase), budget))
        yield from fits[-1]
    if not any(budget.fits(trial.length_m) for fit in fits for trial in fit):
        x0, y0, x1, y1 = waters.free.bounds
        yield attempt(Pattern(2 * math.hypot(x1 - x0, y1 - y0), REACHES[0], PHASES[0]))


def _score(trial: Trial, waters: Waters, budget: Budget) -> float:
    """The sum of the largest and the 95th percentile of the distance to the path, over that of a perfect plan.

    A path much shorter than allowed is charged for what it leaves unused.
    """
    distance = waters.probe.distances(trial.path)
    unused = max(0.0, budget.enough_m / trial.length_m - 1.0)
    return float(distance.max() + np.quantile(distance, 0.95)) * (1.0 + unused)
