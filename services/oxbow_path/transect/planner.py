"""The Transect planner: several patterns, each fitted to the length, and the best path of all."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
import shapely

from oxbow_path.improvement import improved, method_plan
from oxbow_path.refinement import Polyline
from oxbow_path.task import Display, MethodPlan, Task
from oxbow_path.transect.pattern import try_transects
from oxbow_path.transect.show import show_transects
from oxbow_path.walk.remainder import with_remainder
from oxbow_path.walk.spacing import Budget, best_trial, fitted
from oxbow_path.walk.trial import Pattern, Trial, Waters

__all__ = ["TransectPlan", "plan_transects", "transects"]

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
    path = improved(_polyline(plan.chosen, task), task, display)
    return method_plan(path, plan.chosen, plan.trials)


def plan_transects(task: Task) -> TransectPlan:
    """The best of several patterns, each fitted to the length."""
    trials = tuple(_trials(task.waters, task.budget, FIRST_SPACING * task.spacing_m))
    chosen = best_trial(trials, task.waters, task.budget)
    return TransectPlan(with_remainder(chosen, task.waters, task.budget), trials)


def _polyline(trial: Trial, task: Task) -> Polyline:
    """The path, its transects rigid: they stand upright in the sweep frame."""
    across, along = np.abs(np.diff(shapely.get_coordinates(trial.path), axis=0)).T
    rigid = (across < UPRIGHT * along) & (along > trial.pattern.spacing_m)
    return Polyline.of(trial.path, task.waters.passable.free_and_rounding, rigid)


def _trials(waters: Waters, budget: Budget, first_spacing_m: float) -> Iterator[Trial]:
    """Fit the middle reach at every phase, then the other reaches at the phase that did best.

    Very long paths are fitted once. Where nothing fits, the last trial has neither transects nor branches.
    """
    attempt = partial(try_transects, waters)
    few = len(waters.probe.points) > MANY_POINTS
    fits = []
    for phase in PHASES[:1] if few else PHASES:
        fits.append(fitted(attempt, Pattern(first_spacing_m, REACHES[0], phase), budget))
        first_spacing_m = fits[-1][-1].pattern.spacing_m
        yield from fits[-1]
    lasts = [fit[-1] for fit in fits]
    best = best_trial(lasts, waters, budget) if any(budget.fits(trial.length_m) for trial in lasts) else lasts[0]
    for reach in () if few else REACHES[1:]:
        # Less reach asks for more branches, which a wider spacing has to pay for.
        spacing_m = best.pattern.spacing_m * float((REACHES[0] / reach) ** REACH_FOR_SPACING)
        fits.append(fitted(attempt, Pattern(spacing_m, reach, best.pattern.phase), budget))
        yield from fits[-1]
    if not any(budget.fits(trial.length_m) for fit in fits for trial in fit):
        x0, y0, x1, y1 = waters.free.bounds
        yield attempt(Pattern(2 * math.hypot(x1 - x0, y1 - y0), REACHES[0], PHASES[0]))
