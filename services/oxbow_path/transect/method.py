"""The Transect planner: a spacing that fits, then the refinement."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import shapely

from oxbow_path.improvement import improved_line, method_plan
from oxbow_path.refinement import Polyline
from oxbow_path.task import Display, MethodPlan, Task
from oxbow_path.transect.show import show_transects
from oxbow_path.walk.pattern import try_transects
from oxbow_path.walk.remainder import with_remainder
from oxbow_path.walk.spacing import fit_spacing
from oxbow_path.walk.trial import Trial

__all__ = ["transects"]

UPRIGHT = 0.02
"""Largest slope, against the sweep line, of what counts as a transect."""

FIRST_SPACING = 1.15
"""The first spacing tried, as a multiple of area / length: turns and ways back cost about as much."""


def transects(task: Task, display: Display) -> MethodPlan:
    """Plan a path of parallel transects, and refine it: transects slide and turn a little, all else moves freely.

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
        Even the shortest way from launch to recovery is longer than the vehicle can go.
    """
    waters = task.waters
    attempt = partial(try_transects, waters)
    fit = fit_spacing(attempt, FIRST_SPACING * task.spacing_m, task.budget, widest_m=waters.widest_m)
    fit = replace(fit, chosen=with_remainder(fit.chosen, waters, task.budget))
    show_transects(fit, display)
    return method_plan(improved_line(_polyline(fit.chosen, task), task, display), fit)


def _polyline(trial: Trial, task: Task) -> Polyline:
    """The path, its transects rigid: they stand upright in the sweep frame."""
    across, along = np.abs(np.diff(shapely.get_coordinates(trial.path), axis=0)).T
    # Links run upright too, but are hardly longer than a spacing: they are left to bend.
    rigid = (across < UPRIGHT * along) & (along > trial.pattern.spacing_m)
    return Polyline.of(trial.path, task.waters.passable.free_and_rounding, rigid)
