"""The spacing loop: the least spacing whose path fits (Rendas and Li 2016, section 1.2.1.1, steps 5 to 8)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import itemgetter

from oxbow.contracts.budget import LENGTH_RESERVE, too_short
from oxbow.errors import Infeasible
from oxbow_path.walk.trial import Pattern, Trial

__all__ = ["TURNS", "Budget", "Fit", "fit_spacing", "interpolated"]

ENOUGH = 0.97
"""Share of the longest length that a path should use."""

TURNS = 8
"""Trials before the best so far is taken."""

LEAST_STEP = 0.1
"""Least share of the way between two known trials that the next one lies from either."""

SENSITIVITY = 1.0
"""Length falls about as the spacing to this power."""


@dataclass(frozen=True)
class Budget:
    """The longest path allowed, and how near its legs may come.

    `spent_m` is what the vehicle needs besides the path; refusals count it in.
    """

    limit_m: float
    least_spacing_m: float = 0.0
    spent_m: float = 0.0

    @property
    def most_m(self) -> float:
        """How long the path may be."""
        return (1.0 - LENGTH_RESERVE) * self.limit_m

    @property
    def enough_m(self) -> float:
        """The least length that counts as using the budget."""
        return ENOUGH * self.limit_m

    def fits(self, length_m: float) -> bool:
        """Whether a path of this length may be planned."""
        return length_m <= self.most_m

    def too_short(self, shortest_m: float) -> Infeasible:
        """The refusal where even the shortest path does not fit."""
        if self.spent_m == 0.0:
            return too_short(self.limit_m, shortest_m)
        way = "the shortest path to its share and home that was found"
        return too_short(self.limit_m + self.spent_m, shortest_m + self.spent_m, what=way)

    def is_enough(self, trial: Trial) -> bool:
        """Whether no smaller spacing need be tried."""
        return self.fits(trial.length_m) and (
            trial.length_m >= self.enough_m or trial.pattern.spacing_m <= self.least_spacing_m
        )


@dataclass(frozen=True)
class Fit:
    """The trial that uses the length best, and all others, in the order of trying."""

    chosen: Trial
    trials: tuple[Trial, ...]


def fit_spacing(
    attempt: Callable[[Pattern], Trial], first_spacing_m: float, budget: Budget, *, widest_m: float = math.inf
) -> Fit:
    """Try spacings until one uses the length well.

    The report multiplies the spacing by length / limit. This does the same, with the sensitivity that the last two
    trials showed, until a spacing too small and one too large are known; then it interpolates between the two.

    Parameters
    ----------
    attempt
        Builds the path for a pattern.
    first_spacing_m
        Where to begin.
    budget
        What fits, and what is enough.
    widest_m
        A spacing that leaves nothing but the way from launch to recovery: the last to be tried, if nothing fits.

    Returns
    -------
    Fit
        Its chosen trial fits the budget.

    Raises
    ------
    Infeasible
        Nothing fits: even the shortest way from launch to recovery is longer than the vehicle can go.
    """
    trials: list[Trial] = []
    spacing_m = max(first_spacing_m, budget.least_spacing_m)
    while len(trials) < TURNS:
        trials.append(attempt(Pattern(spacing_m)))
        if budget.is_enough(trials[-1]):
            break
        spacing_m = max(_next_spacing(trials, budget), budget.least_spacing_m)
    # The last resort: no transects at all, only the way from launch to recovery and branches.
    if math.isfinite(widest_m) and not any(budget.fits(trial.length_m) for trial in trials):
        trials.append(attempt(Pattern(widest_m)))
    return Fit(_longest(trials, budget), tuple(trials))


def _longest(trials: Sequence[Trial], budget: Budget) -> Trial:
    """The longest trial that fits."""
    fitting = [trial for trial in trials if budget.fits(trial.length_m)]
    # Longest, not finest: length is what a path may use, and more of it serves the water better.
    if fitting:
        return max(fitting, key=lambda trial: trial.length_m)
    shortest_m = min(trial.length_m for trial in trials)
    raise budget.too_short(shortest_m)


def _next_spacing(trials: Sequence[Trial], budget: Budget) -> float:
    # Length is about a power of the spacing, so that the two are nearly linear in logarithms.
    target = math.log((budget.most_m + budget.enough_m) / 2)
    points = [(math.log(trial.length_m), math.log(trial.pattern.spacing_m)) for trial in trials]
    too_small = max((point for point in points if point[0] > target), key=itemgetter(1), default=None)
    too_large = min((point for point in points if point[0] <= target), key=itemgetter(1), default=None)
    if too_small is not None and too_large is not None:
        return math.exp(interpolated(too_small, too_large, target))
    sensitivity = SENSITIVITY
    if len(points) > 1 and points[-1][1] != points[-2][1]:
        # Bounded below, since length jumps where a transect more fits: two trials may show a slope of 0.
        seen = (points[-2][0] - points[-1][0]) / (points[-1][1] - points[-2][1])
        sensitivity = min(max(seen, SENSITIVITY / 2), SENSITIVITY * 2)
    return math.exp(points[-1][1] + (points[-1][0] - target) / sensitivity)


def interpolated(one: tuple[float, float], other: tuple[float, float], length: float) -> float:
    """The setting that should give a length, linear between two trials that gave less and more of it.

    Parameters
    ----------
    one, other
        The length of each trial, and the setting that gave it, in whatever measure makes the two about linear.
    length
        What is wanted, in the same measure.

    Returns
    -------
    float
        Between the two settings, a tenth of the way from either at the least.
    """
    share = (length - one[0]) / (other[0] - one[0])
    # Interpolation alone may creep towards one end, and length jumps where a transect or a site more fits.
    share = min(max(share, LEAST_STEP), 1 - LEAST_STEP)
    return one[1] + share * (other[1] - one[1])
