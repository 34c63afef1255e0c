"""How the methods end: refined, under what length there is."""

from __future__ import annotations

from collections.abc import Sequence

from shapely import LineString

from oxbow.contracts import SpacingStep
from oxbow_path.refinement import Polyline, refined_path
from oxbow_path.task import Display, MethodPlan, Task
from oxbow_path.walk.spacing import Fit
from oxbow_path.walk.trial import Trial

__all__ = ["improved_line", "method_plan", "spacing_steps"]


def improved_line(path: Polyline, task: Task, display: Display) -> LineString:
    """The path refined for the task; one already longer than is useful may stay as long.

    Parameters
    ----------
    path
        Simple, and inside the free space except for its legs.
    task
        The water, its samples, and the length that there is.
    display
        Shows every step.

    Returns
    -------
    LineString
        No longer than the budget, unless no refinement made the given path fit.
    """
    # A path that fits keeps its length, even where less would be useful: shortening it would open gaps.
    fits = task.budget.fits(path.length_m)
    return refined_path(
        path,
        task.waters.free,
        task.samples,
        length_m=max(path.length_m, task.useful_length_m) if fits else task.useful_length_m,
        spacing_m=task.spacing_m,
        enough_m=task.enough_m,
        stop=task.stop,
        watch=display.refinement,
    )


def method_plan(path: LineString, fit: Fit) -> MethodPlan:
    """The plan of a method that fits a spacing.

    Parameters
    ----------
    path
        What the chosen trial became when it was refined.
    fit
        The chosen trial, and all others.

    Returns
    -------
    MethodPlan
        With the spacing and reach of the chosen pattern, and all that were tried as its steps.
    """
    chosen = fit.chosen.pattern
    return MethodPlan(path, chosen.spacing_m, chosen.reach_m, spacing_steps(fit.trials))


def spacing_steps(trials: Sequence[Trial]) -> tuple[SpacingStep, ...]:
    """The spacings tried, and the lengths that they gave."""
    return tuple(SpacingStep(spacing_m=trial.pattern.spacing_m, length_m=trial.length_m) for trial in trials)
