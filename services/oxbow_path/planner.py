"""The Transect planner: several patterns, each fitted to the length, and the best path of all."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
import shapely
from shapely import Point

from oxbow.contracts import FreeSpace, PathRequest
from oxbow.errors import Infeasible
from oxbow.sweep import to_sweep
from oxbow_path.legs import Passable, access
from oxbow_path.probe import Probe
from oxbow_path.remainder import with_remainder
from oxbow_path.routes import Routes
from oxbow_path.spacing import Budget, fitted
from oxbow_path.transect import Pattern, Trial, Waters, try_pattern

__all__ = ["ACCEPTED", "TransectPlan", "finest_spacing_m", "plan_transects"]

LENGTH_USED = (0.97, 0.999)
"""Shares of the longest length that a path should use."""

ACCEPTED = 0.95
"""Share of the longest length below which a plan says why it does not use more (report: 5 %)."""

FIRST_SPACING = 1.15
"""The first spacing tried, as a multiple of area / length: turns and ways back cost about as much."""

REACHES = (1.5, 1.3, 1.8)
PHASES = (0.25, 0.75)
REACH_FOR_SPACING = 0.6
"""The fitting spacing falls about as the reach to this power."""

FINEST = 200
"""At most so many spacings make up the root of the water's area."""

MANY_POINTS = 80_000
"""With more probe points than these, one pattern is fitted and not several."""

PROBE_PITCH = 0.35
"""Pitch of the probe grid, in nominal spacings."""


@dataclass(frozen=True)
class TransectPlan:
    """The chosen trial and all others, in the order of trying; sweep frame."""

    waters: Waters
    chosen: Trial
    trials: tuple[Trial, ...]


def plan_transects(request: PathRequest) -> TransectPlan:
    """Plan a Transect path.

    Raises
    ------
    Infeasible
        Even the shortest way from launch to recovery is longer than the vehicle can go.
    """
    least_spacing_m = max(request.min_spacing_m, finest_spacing_m(request.space))
    nominal_m = max(request.space.free.area / request.length_m, least_spacing_m)
    waters = _waters(request, nominal_m)
    enough, most = (share * request.length_m for share in LENGTH_USED)
    budget = Budget(most, enough, least_spacing_m)
    trials = tuple(_trials(waters, budget, FIRST_SPACING * nominal_m))
    fitting = [trial for trial in trials if budget.fits(trial.length_m)]
    if not fitting:
        shortest = min(trial.length_m for trial in trials)
        raise Infeasible(
            f"is {request.length_m:.0f} m; the shortest path from launch to recovery is {shortest:.0f} m",
            "Master_length",
        )
    chosen = min(fitting, key=lambda trial: _score(trial, waters, budget))
    if chosen.pattern.spacing_m > least_spacing_m:
        chosen = with_remainder(chosen, waters, budget)
    return TransectPlan(waters, chosen, trials)


def finest_spacing_m(space: FreeSpace) -> float:
    """The least spacing that is planned: finer sampling of small waters takes long, and serves no one.

    Rendas and Li 2016, section 1.2.1.2, find that the spacing needs a least value for small sites.
    """
    return math.sqrt(space.free.area) / FINEST


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


def _require_connected(request: PathRequest) -> None:
    """A point in water that is not connected to the free space cannot be reached at the safety distance."""
    for where, place in (("LaunchPoint", request.launch), ("RecoveryPoint", request.recovery)):
        for part in request.space.dropped:
            if part.outline.covers(Point(place)):
                raise Infeasible(
                    f"lies in {part.area_m2:.0f} m2 of water that is left out ({part.reason}); move it into the"
                    " largest part, or choose a smaller Safety",
                    where,
                )


def _waters(request: PathRequest, spacing_m: float) -> Waters:
    """Turn the request into the sweep frame, and prepare what all trials share."""
    _require_connected(request)
    turn = partial(to_sweep, heading_rad=request.decomposition.heading_rad)
    free, water = (shapely.transform(polygon, turn) for polygon in (request.space.free, request.space.water))
    shapely.prepare([free, water])
    shore = Routes(water, spacing_m)
    (launch, recovery) = turn(np.array([request.launch, request.recovery]))
    return Waters(
        spacing_m=spacing_m,
        cells=request.decomposition.cells,
        free=free,
        passable=Passable(free),
        probe=Probe.over(free, PROBE_PITCH * spacing_m),
        routes=Routes(free, PROBE_PITCH * spacing_m),
        launch=access(tuple(launch), free, shore, where="LaunchPoint"),
        recovery=access(tuple(recovery), free, shore, where="RecoveryPoint"),
    )
