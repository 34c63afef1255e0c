"""The method Tour, from task to plan."""

from __future__ import annotations

from shapely import Point

from oxbow_path.improvement import improved_line, spacing_steps
from oxbow_path.refinement import Polyline
from oxbow_path.task import Display, MethodPlan, Task
from oxbow_path.tour.planner import plan_tour

__all__ = ["tour"]


def tour(task: Task, display: Display) -> MethodPlan:
    """Plan a path along a tour, and refine it.

    Parameters
    ----------
    task
        The request made ready.
    display
        Shows every trial, the chosen tour, and the refinement.

    Returns
    -------
    MethodPlan
        Its spacing is the pitch of the sites.

    Raises
    ------
    Infeasible
        Even the shortest way from launch to recovery is longer than the vehicle can go.
    """
    plan = plan_tour(task)
    for step, trial in enumerate(plan.trials):
        label = f"{len(trial.tour.order)} sites by {trial.tour.solver}"
        display.lines("iterations", [trial.path], step=step, labels=(label,))
        display.figures("loop", {"sites": len(trial.tour.order), "length_m": trial.length_m}, step=step)
    chosen = plan.chosen
    display.lines("sites", [Point(site) for site in chosen.tour.sites])
    display.lines("tour", [chosen.tour.way])
    path = Polyline.of(chosen.path, task.waters.passable.free_and_rounding)
    steps = spacing_steps([trial.trial for trial in plan.trials])
    return MethodPlan(improved_line(path, task, display), chosen.spacing_m, chosen.trial.pattern.reach_m, steps)
