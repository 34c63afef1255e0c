"""The remainder: length that no spacing could use is spent on the worst gaps.

Where the length is short for the water, no spacing may fit but one that leaves most of it unused. The refinement
moves what is there, and cannot see round a headland; spurs can.
"""

from __future__ import annotations

import numpy as np
import shapely
from shapely import LineString, Point
from shapely.ops import substring

from oxbow.arrays import FloatArray
from oxbow.tolerances import ROUNDING_M
from oxbow_path.walk.gaps import branch_to
from oxbow_path.walk.region import Brush, Walk, largest, simply_connected
from oxbow_path.walk.spacing import Budget
from oxbow_path.walk.trial import Trial, Waters, touches_entries, trial_with_legs

__all__ = ["with_remainder"]

SPURS = 12
"""At most this many spurs are added."""

SPUR = 0.12
"""Half width of a spur, in nominal spacings: narrow, so that it parts the water that it runs into."""

LEAST_SHARE = 0.002
"""A remainder smaller than this share of the length is left."""

SHORTENINGS = 4

LEAST_CLEARANCE_M = 1e-8
"""Stretches of a path that come nearer to each other than this may cross by rounding."""


def with_remainder(trial: Trial, waters: Waters, budget: Budget) -> Trial:
    """Add spurs to the worst gaps, one after another, while they fit the length and make no gap deeper.

    A trial that uses the length well enough stays as it is: the refinement spends the rest better.

    Parameters
    ----------
    trial
        A path that fits the budget.
    waters
        The water that it was made for.
    budget
        The longest path, and how much of that is enough.

    Returns
    -------
    Trial
        The trial with its spurs, or itself where none fits.
    """
    if budget.is_enough(trial):
        return trial
    for _ in range(SPURS):
        left_m = budget.most_m - trial.length_m
        longer = _with_spur(trial, waters, left_m) if left_m > LEAST_SHARE * budget.most_m else None
        if longer is None:
            break
        trial = longer
    return trial


def _with_spur(trial: Trial, waters: Waters, left_m: float) -> Trial | None:
    """The trial with a spur towards its worst gap, as long as fits; None if none does."""
    distance = waters.probe.distances(trial.path)
    gap, depth_m = waters.probe.points[np.argmax(distance)], float(distance.max())
    spur = _end(_spur(trial, waters, gap), left_m / 2)
    for _ in range(SHORTENINGS):
        longer = _grown(trial, waters, spur)
        if longer is None:
            return None
        # A spur is walked on both sides, but where it meets other bands it may also shorten the path.
        growth_m = longer.length_m - trial.length_m
        if (
            0.0 < growth_m <= left_m
            # A spur may merge with bands beside it, whose rings then serve nothing: no gap may become deeper for
            # it.
            and waters.probe.distances(longer.path).max() <= depth_m
            and _keeps_clear(longer.path)
        ):
            return longer
        spur = _end(spur, spur.length * (0.95 * left_m / growth_m if growth_m > left_m else 0.5))
    return None


def _spur(trial: Trial, waters: Waters, gap: FloatArray) -> LineString:
    """From the gap to the walk: to its ring from the inside, into its region from outside."""
    region = trial.walk.region
    if shapely.contains_xy(region, *gap):
        return shapely.shortest_line(Point(gap), region.exterior)
    goals = waters.routes.goals_in(region)
    return branch_to(gap, region, waters.routes, goals, SPUR * waters.spacing_m)


def _end(line: LineString, length_m: float) -> LineString:
    """The last `length_m` metres of a line."""
    end = substring(line, max(line.length - length_m, 0.0), line.length)
    return end if isinstance(end, LineString) else line


def _grown(trial: Trial, waters: Waters, spur: LineString) -> Trial | None:
    """The trial with a spur: a band outside its region, a slit inside; None where that parts it from an entry."""
    region, half_width_m = trial.walk.region, SPUR * waters.spacing_m
    if shapely.contains_xy(region, *spur.coords[0]):
        region = largest(region.difference(spur.buffer(half_width_m)))
    else:
        region = largest(region.union(Brush(waters.free, half_width_m, 0.0).bands([spur])))
    walk = simply_connected(
        region, waters.free, waters.probe, cut_width_m=trial.pattern.cut_m, reach_m=trial.pattern.reach_m
    )
    if not touches_entries(walk.region, waters):
        return None
    return trial_with_legs(
        waters, trial.pattern, trial.circuit, Walk(walk.region, trial.walk.cuts, trial.walk.enclosed)
    )


def _keeps_clear(path: LineString) -> bool:
    """Whether no two stretches are so near to each other that they may cross once the path is turned."""
    distinct = shapely.remove_repeated_points(path, ROUNDING_M)
    return bool(shapely.minimum_clearance(distinct) > LEAST_CLEARANCE_M)
