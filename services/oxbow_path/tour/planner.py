"""The Tour planner: as many sites as the length allows, a tour through them, and its outline."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
import shapely
from shapely import LineString

from oxbow.arrays import FloatArray, Indices
from oxbow_path.task import Task
from oxbow_path.tour.geodesic import Geodesics, ShoreSights
from oxbow_path.tour.local_search import shortened_tour
from oxbow_path.tour.outline import enclosed_region
from oxbow_path.tour.pruning import pruned_order
from oxbow_path.tour.pyvrp_solver import is_installed, polished_tour
from oxbow_path.tour.sites import cluster_centres, low_discrepancy, with_gaps
from oxbow_path.tour.solver import Solver, TourSolution
from oxbow_path.tour.start import first_tour
from oxbow_path.walk.region import Brush, Circuit, Walk, clear_of_land, simply_connected
from oxbow_path.walk.remainder import with_remainder
from oxbow_path.walk.spacing import TURNS, Budget, interpolated
from oxbow_path.walk.trial import Pattern, Trial, Waters, grown_to_entries, trial_with_legs

__all__ = ["TourPlan", "TourTrial", "plan_tour"]

EVENNESS = 0.98
"""The shortest tour of n sites over area A has about this length, times the root of n A.

Of sites at random it would have 0.7124 (Beardwood, Halton and Hammersley 1959): clustering keeps them apart.
"""

SAMPLES = 25
"""Low-discrepancy points per site."""

MOST_SAMPLES = 150_000

LEAST_SITES = 4
"""Fewer sites have one tour only."""

NEAR = 4.0
"""Sites farther apart than this, in pitches, do not follow each other, except for legs of the first tour."""

GAP = 0.85
"""Water farther than this from every site is given one more, in pitches."""

CLEAR_M = 1e-9
"""Parts of a path nearer to each other than this may cross once it is turned."""

LANE = 0.1
"""Half width of a lane, in pitches."""


@dataclass(frozen=True)
class Tour:
    """A closed tour in the sweep frame.

    `count` clusters were asked for; the sites are the launch and recovery points' entries, the clusters' centres,
    and what was added far from all of these. `order` holds those that are visited, `solver` what ordered them.
    """

    count: int
    pitch_m: float
    entries: int
    geodesics: Geodesics
    order: Indices
    solver: str

    @property
    def sites(self) -> FloatArray:
        """The sites in the order of their visits, shape (n, 2)."""
        return self.geodesics.places[self.order]

    @cached_property
    def way(self) -> LineString:
        """The shortest way through all of them, and back to the first."""
        return LineString(self.geodesics.way(self.order))


@dataclass(frozen=True)
class TourTrial:
    """A path round a tour."""

    tour: Tour
    trial: Trial

    @property
    def path(self) -> LineString:
        """From launch to recovery, simple and inside the free space except for its legs."""
        return self.trial.path

    @property
    def length_m(self) -> float:
        """The length of the path."""
        return self.trial.length_m

    def fits(self, budget: Budget) -> bool:
        """Whether the path is short enough, and not simple by rounding alone: still so when turned."""
        return budget.fits(self.length_m) and bool(shapely.minimum_clearance(self.path) > CLEAR_M)

    @property
    def spacing_m(self) -> float:
        """Distance of neighbouring sites, and about that of neighbouring legs."""
        return self.tour.pitch_m


@dataclass(frozen=True)
class TourPlan:
    """The chosen trial, and all in the order of trying; sweep frame."""

    chosen: TourTrial
    trials: tuple[TourTrial, ...]


def plan_tour(task: Task, *, solver: Solver | None = None) -> TourPlan:
    """Plan a path along a tour through points of low discrepancy (Rendas and Li 2016, section 1.2.1.3).

    Parameters
    ----------
    task
        The water, the longest length, the least spacing, the seed.
    solver
        What shortens tours; the best that is installed where absent.

    Returns
    -------
    TourPlan
        Its chosen trial fits the budget.

    Raises
    ------
    Infeasible
        Even the shortest way from launch to recovery is longer than the vehicle can go.
    """
    budget = task.budget
    area_m2 = task.waters.free.area
    # More sites than one per square of the least spacing would put legs nearer than that.
    most = max(1, int(area_m2 / budget.least_spacing_m**2))
    first = min(most, max(1, round((budget.most_m / EVENNESS) ** 2 / area_m2)))
    attempt = _Attempt(
        task.waters, min(2 * SAMPLES * first, MOST_SAMPLES), task.request.seed, solver or _best_solver()
    )
    trials = list(_fitted(attempt, first, most, budget))
    if not any(_is_enough(trial, budget, most) for trial in trials):
        trials.extend(_shortened(attempt, trials, budget))
    fitting = [trial for trial in trials if trial.fits(budget)]
    # The trials end with a tour of the entries alone: where that does not fit, no tour does.
    if not fitting:
        shortest_m = min(trial.length_m for trial in trials)
        raise budget.too_short(shortest_m)
    chosen = min(fitting, key=lambda trial: _score(trial, task.waters, budget))
    if not _is_enough(chosen, budget, most):
        # Length left over goes to spurs, unless these make the path simple by rounding alone.
        longer = replace(chosen, trial=with_remainder(chosen.trial, task.waters, budget))
        chosen = longer if longer.fits(budget) else chosen
    return TourPlan(chosen, tuple(trials))


def _is_enough(trial: TourTrial, budget: Budget, most: int) -> bool:
    """Whether a path fits the length, and uses it or has as many sites as there may be."""
    return trial.fits(budget) and (trial.length_m >= budget.enough_m or trial.tour.count >= most)


def _score(trial: TourTrial, waters: Waters, budget: Budget) -> float:
    """The largest distance to the path, charged for what the path leaves unused of the length."""
    return float(waters.probe.distances(trial.path).max()) * max(1.0, budget.enough_m / trial.length_m)


def _best_solver() -> Solver:
    return polished_tour if is_installed() else shortened_tour


@dataclass(frozen=True)
class _Attempt:
    """Plans a path through any number of sites."""

    waters: Waters
    samples_count: int
    seed: int
    solver: Solver

    @cached_property
    def _samples(self) -> FloatArray:
        return low_discrepancy(self.waters.free, self.samples_count, seed=self.seed)

    @cached_property
    def _shore(self) -> ShoreSights:
        return ShoreSights(self.waters.free)

    def tour(self, count: int) -> Tour:
        """A tour of `count` clusters; with none, of the entries alone."""
        pitch_m = math.sqrt(self.waters.free.area / count) if count else self.waters.spacing_m
        entries = np.unique(shapely.get_coordinates(self.waters.entries), axis=0)
        geodesics = self._shore.geodesics(self._sites(entries, count, pitch_m))
        solution = self._solution(geodesics, NEAR * pitch_m)
        return Tour(count, pitch_m, len(entries), geodesics, solution.order, solution.solver)

    def path(self, tour: Tour) -> TourTrial:
        """The path round a tour."""
        waters, lane_m = self.waters, LANE * tour.pitch_m
        pattern = Pattern(tour.pitch_m)
        # The lane round the tour encloses a region; its boundary is the ring that the path travels.
        walk = simply_connected(
            enclosed_region(shapely.get_coordinates(tour.way), waters.free, lane_m),
            waters.free,
            waters.probe,
            cut_width_m=2 * lane_m,
            reach_m=pattern.reach_m,
        )
        # Together with the region a lane may enclose land, or touch it: both would open the boundary.
        clear = partial(clear_of_land, free=waters.free)
        region = grown_to_entries(walk.region, waters, Brush(waters.free, lane_m, 0.0), cleaned=clear)
        reached = Walk(region, walk.cuts, walk.enclosed)
        return TourTrial(tour, trial_with_legs(waters, pattern, Circuit((), ()), reached))

    def _sites(self, entries: FloatArray, count: int, pitch_m: float) -> FloatArray:
        if count == 0:
            return entries
        # Centres of clusters may leave water far away, in a corner or an arm: sites are added there.
        centres = cluster_centres(self._samples, count, self.waters.free)
        return with_gaps(np.vstack([entries, centres]), self.waters.probe.points, GAP * pitch_m)

    def _solution(self, geodesics: Geodesics, near_m: float) -> TourSolution:
        """A short tour; of fewer than four sites there is only one."""
        if geodesics.count < LEAST_SITES:
            return TourSolution(np.arange(geodesics.count), "")
        return self.solver(first_tour(geodesics, near_m), seed=self.seed)


def _fitted(attempt: _Attempt, first: int, most: int, budget: Budget) -> tuple[TourTrial, ...]:
    """Trials of different counts, until one uses the length well or no better count is found."""
    trials: dict[int, TourTrial] = {}
    count = first
    while count not in trials and len(trials) < TURNS:
        trials[count] = trial = attempt.path(attempt.tour(count))
        if _is_enough(trial, budget, most):
            break
        count = min(most, _next_count(trials, (budget.enough_m + budget.most_m) / 2))
    return tuple(trials.values())


def _next_count(trials: Mapping[int, TourTrial], target_m: float) -> int:
    """The count for a length, which grows as the root of the count; between two known where there are two."""
    points = sorted((trial.length_m, math.sqrt(count)) for count, trial in trials.items())
    too_short = [point for point in points if point[0] <= target_m]
    too_long = [point for point in points if point[0] > target_m]
    if too_short and too_long:
        return round(interpolated(too_short[-1], too_long[0], target_m) ** 2)
    length_m, root = (too_short or too_long)[-1 if too_short else 0]
    return round((root * target_m / length_m) ** 2)


def _shortened(attempt: _Attempt, trials: Sequence[TourTrial], budget: Budget) -> Iterator[TourTrial]:
    """Trials of the shortest tour that is too long, less some of its sites, until one uses the length well.

    Where all are too long, the last visits nothing but the entries.
    """
    # Sites can be left out only of a tour that is too long.
    too_long = [trial for trial in trials if not trial.fits(budget)]
    if not too_long:
        return
    whole = min(too_long, key=lambda trial: trial.length_m)
    target_m = (budget.enough_m + budget.most_m) / 2
    tour_m, fits = whole.tour.way.length + target_m - whole.length_m, len(too_long) < len(trials)
    tried = {len(whole.tour.order)}
    for _ in range(TURNS):
        order = pruned_order(whole.tour.order, whole.tour.geodesics, kept=whole.tour.entries, length_m=tour_m)
        if len(order) in tried:
            break
        tried.add(len(order))
        trial = attempt.path(replace(whole.tour, order=order))
        yield trial
        fits = fits or trial.fits(budget)
        if trial.fits(budget) and trial.length_m >= budget.enough_m:
            break
        # The tour's length is aimed at by what the path's was off: lanes and legs cost about the same each time.
        tour_m = max(0.0, tour_m + target_m - trial.length_m)
    if not fits:
        yield attempt.path(attempt.tour(0))
