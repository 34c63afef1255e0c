"""The method SpaceFillingCurve (Rendas and Li 2016, section 1.2.1.4)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from oxbow.contracts import SpacingStep
from oxbow_path.improvement import improved_line
from oxbow_path.refinement import NODE_WORK, Guard, Polyline, weights_at
from oxbow_path.space_filling_curve.draws import drawn_places
from oxbow_path.space_filling_curve.kohonen import NODES_PER_SPACING, Epoch, UpdateSchedule, organised_curve
from oxbow_path.task import SHOWN_EVERY, Display, MethodPlan, Task
from oxbow_path.walk.pattern import try_transects
from oxbow_path.walk.remainder import with_remainder
from oxbow_path.walk.trial import Pattern, Trial

__all__ = ["space_filling_curve"]

START_SPACINGS = (2.0, 3.0, 5.0, 8.0)
"""The first walk's spacing, in nominal ones: the first that fits. About half the length is left to the ring,
which folds it into the water without a preferred direction.
"""

LEAST_START = 0.35
"""A first walk shorter than this share of the longest length gets spurs: it leaves the ring too much to find."""

EPOCHS = (8, 30)
"""Fewest and most updates of the ring."""

WORK = 3_000_000
"""Updates times draws, and nodes: very long paths get fewer updates."""

REACH_NAMED = 2.0
"""Water farther from the path than this many half spacings is named as dropped."""


def space_filling_curve(task: Task, display: Display) -> MethodPlan:
    """Plan a path as a Kohonen ring.

    The steps are those of the report: a circuit over the cells, low-discrepancy sequences in each, a ring
    that is updated with them until it has spread, a number of nodes that follows the length. Two things are added:
    every update is guarded, so that the path stays simple and inside through islands, straits and narrow arms,
    and the refinement ends it, since the ring ignores its worst gap, and keeps only roughly to the length.

    Parameters
    ----------
    task
        The request made ready.
    display
        Shows how the path came about.

    Returns
    -------
    MethodPlan
        Its spacing is the nominal one: a ring has no legs at a pitch.

    Raises
    ------
    Infeasible
        Even the shortest way from launch to recovery is longer than the vehicle can go.
    """
    start = _start(task)
    display.lines("circuit", (*start.circuit.transects, *start.circuit.links))
    display.lines("start", [start.path])
    ring = Polyline.of(start.path, task.waters.passable.free_and_rounding)
    steps = [SpacingStep(spacing_m=start.pattern.spacing_m, length_m=start.length_m)]
    for number, epoch in enumerate(_epochs(ring, task)):
        ring = epoch.ring
        figures = {"nodes": len(ring.nodes), "length_m": ring.length_m, "neighbourhood": epoch.width}
        display.figures("epochs", figures, step=number)
        if number % SHOWN_EVERY == 0:
            display.lines("ring", [ring.line], step=number, labels=(f"epoch {number}",))
    path = improved_line(ring, task, display)
    # A ring that grew too long may not shorten enough under the guard; the walk it began from fits.
    if not task.budget.fits(path.length):
        path = improved_line(Polyline.of(start.path, task.waters.passable.free_and_rounding), task, display)
    steps.append(SpacingStep(spacing_m=task.spacing_m, length_m=path.length))
    return MethodPlan(path, task.spacing_m, REACH_NAMED * task.spacing_m / 2, tuple(steps))


def _start(task: Task) -> Trial:
    """The walk over the circuit of the cells, as coarse as it must be to fit; at last without transects."""
    for spacing_m in (*(factor * task.spacing_m for factor in START_SPACINGS), task.waters.widest_m):
        trial = try_transects(task.waters, Pattern(spacing_m))
        if task.budget.fits(trial.length_m):
            is_starved = trial.length_m < LEAST_START * task.budget.limit_m
            return with_remainder(trial, task.waters, task.budget) if is_starved else trial
    raise task.budget.too_short(trial.length_m)


def _epochs(ring: Polyline, task: Task) -> Iterator[Epoch]:
    request = task.request
    count = len(task.samples)
    work = count + NODE_WORK * NODES_PER_SPACING * task.useful_length_m / task.spacing_m
    draws = drawn_places(task.waters.cells, count, seed=request.seed, draw=request.draw)
    return organised_curve(
        ring,
        draws,
        # Squared: a place of weight w is to be w times as near, which takes w^2 times as many draws.
        weights_at(draws, task.areas) ** 2,
        Guard.of(task.waters.free, ring, task.spacing_m),
        length_m=task.useful_length_m,
        spacing_m=task.spacing_m,
        schedule=UpdateSchedule(int(np.clip(WORK // work, *EPOCHS))),
        stop=task.stop,
    )
