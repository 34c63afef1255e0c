"""The spacing loop: the least spacing whose path fits (Rendas and Li 2016, section 1.2.1.1, steps 5 to 8)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from oxbow_path.transect import Pattern, Trial

__all__ = ["Budget", "fitted"]

TURNS = 8
"""Trials for one pattern before the best so far is taken."""

SENSITIVITY = 1.1
"""Length falls about as spacing to this power: faster than its inverse, since wide spacings also skip inlets."""


@dataclass(frozen=True)
class Budget:
    """How long the path may be, how long it should be at least, and how near its legs may come."""

    most_m: float
    enough_m: float
    least_spacing_m: float = 0.0

    def fits(self, length_m: float) -> bool:
        return length_m <= self.most_m

    def is_enough(self, trial: Trial) -> bool:
        """No smaller spacing need be tried."""
        return self.fits(trial.length_m) and (
            trial.length_m >= self.enough_m or trial.pattern.spacing_m <= self.least_spacing_m
        )


def fitted(attempt: Callable[[Pattern], Trial], start: Pattern, budget: Budget) -> Iterator[Trial]:
    """Try spacings until one uses the length well; every trial is yielded, the fitting ones among them.

    The report multiplies the spacing by length / limit. This does the same until a spacing too small and one too
    large are known, and then interpolates between their logarithms.
    """
    too_long: Trial | None = None
    fitting: Trial | None = None
    spacing_m = max(start.spacing_m, budget.least_spacing_m)
    for _ in range(TURNS):
        trial = attempt(Pattern(spacing_m, start.reach, start.phase))
        yield trial
        if budget.is_enough(trial):
            return
        if budget.fits(trial.length_m):
            fitting = trial
        else:
            too_long = trial
        spacing_m = max(_next_spacing(too_long, fitting, budget), budget.least_spacing_m)


def _next_spacing(too_long: Trial | None, fitting: Trial | None, budget: Budget) -> float:
    target_m = (budget.most_m + budget.enough_m) / 2
    if too_long is not None and fitting is not None:
        low, high = math.log(too_long.pattern.spacing_m), math.log(fitting.pattern.spacing_m)
        above, below = math.log(too_long.length_m / target_m), math.log(target_m / fitting.length_m)
        share = min(max(above / (above + below), 0.1), 0.9)
        return math.exp(low + share * (high - low))
    trial = too_long or fitting
    if trial is None:
        raise ValueError("no trial to go on from")
    return trial.pattern.spacing_m * float((trial.length_m / target_m) ** (1 / SENSITIVITY))
