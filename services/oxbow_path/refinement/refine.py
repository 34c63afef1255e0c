"""The refinement loop: pull, move what may move, keep the best."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from shapely import LineString, Polygon

from oxbow.arrays import FloatArray
from oxbow_path.refinement.guard import Guard
from oxbow_path.refinement.polyline import Polyline
from oxbow_path.refinement.pull import Pull, feet
from oxbow_path.refinement.samples import Samples

__all__ = ["NODE_WORK", "RefinementStep", "Stop", "refined_path"]

Stop = Callable[[], bool]
"""Asked before each step whether time is up."""

STEPS = (15, 60)
"""Fewest and most steps."""

WORK = 7_000_000
"""Steps times samples, and nodes as `NODE_WORK` counts them: about a microsecond each."""

NODE_WORK = 15
"""A node takes as long as this many samples."""

POWERS = (4.0, 16.0)
"""The power of the distance whose sum is minimised: first the mean counts, at last the largest."""

STEP_FOR_POWER = 2.0
"""A foot moves by this over the power of the way to its sample: a Newton step for one sample."""

LONGEST, SHORTEST = 0.6, 0.25
"""Segments are divided above, and nodes dropped below, these lengths, in spacings."""

FARTHEST_STEP = 0.25
"""No node moves farther in one step, in spacings."""

FARTHEST_PULL = 2.5
"""Samples farther from the path than this many radii pull no harder."""

AIM = 0.998
"""Share of the longest length that the steps aim at; the guard may keep a path from shortening as far."""

LEAST_M = 1e-12
"""Shorter steps have no direction."""

EVENNESS_QUANTILE = 0.95


@dataclass(frozen=True)
class RefinementStep:
    """Where the refinement stands: the path, its length, and how far the samples are from it.

    `largest_m` is the largest distance of a sample, `p95_m` the 95th percentile, both times the samples' weights.
    """

    path: LineString
    length_m: float
    largest_m: float
    p95_m: float

    @property
    def score_m(self) -> float:
        """What the refinement makes small."""
        return self.largest_m + self.p95_m


def refined_path(
    path: Polyline,
    free: Polygon,
    samples: Samples,
    *,
    length_m: float,
    spacing_m: float,
    enough_m: float = 0.0,
    stop: Stop,
    watch: Callable[[int, RefinementStep], None],
) -> LineString:
    """Move waypoints towards the gaps, under the length that there is.

    Each step minimises the sum of a power of the samples' distances to the path, over the nodes, with the length
    as a constraint whose multiplier is the path's tension: where the path serves little, tension shortens it,
    and the length is spent where it serves more. The power grows, and with it the weight of the worst gaps: its
    limit is the MinMax criterion of Rendas and Li 2016, section 1.2.1. Nodes are added where segments grow long
    and dropped where they crowd. The guard lets no step leave the free space or cross the path.

    Parameters
    ----------
    path
        A simple path inside `free` except for its legs.
    free
        The free space.
    samples
        Places that are to lie near the path.
    length_m
        The longest path allowed.
    spacing_m
        The nominal spacing, area / length.
    enough_m
        A path this near to all samples, and no longer than allowed, is not refined further.
    stop
        Asked before each step whether time is up; a path still too long goes on. Without a limit the number of
        steps is fixed by the samples.
    watch
        Called with the number and the state of every step.

    Returns
    -------
    LineString
        The best path met that is no longer than `length_m`: never worse than the given one, if that fits.
    """
    states = _states(path, Guard.of(free, path, spacing_m), samples, length_m, spacing_m, stop)
    best = next(states)
    watch(0, best)
    if _is_enough(best, enough_m, length_m):
        return path.line
    for number, state in enumerate(states, start=1):
        watch(number, state)
        best = _better(state, best, length_m)
        if _is_enough(best, enough_m, length_m):
            break
    return best.path


def _states(
    path: Polyline, guard: Guard, samples: Samples, length_m: float, spacing_m: float, stop: Stop
) -> Iterator[RefinementStep]:
    """The given path, and the path after each step."""
    last = int(np.clip(WORK // (len(samples) + NODE_WORK * len(path.nodes)), *STEPS))
    tension, aim_m = None, AIM * length_m
    for number in range(last + 1):
        # Thinned before divided: what crowds is dropped, and the segment left may then be long enough to divide.
        path = guard.thinned(path, path.crowded(2 * SHORTEST * spacing_m)).divided(LONGEST * spacing_m)
        # Nearest places anew at each step: the weights are those of least squares for the present distances.
        at = feet(path, samples.points, spacing_m)
        weighed_m = at.distance_m * samples.weights
        yield _state(path, weighed_m)
        # Out of time, a path that is too long goes on: it is of no use to anyone.
        if number == last or (path.length_m <= length_m and stop()):
            return
        power = POWERS[0] + (POWERS[1] - POWERS[0]) * number / last
        pull = samples.area_weights * _pull(weighed_m, spacing_m / 2, power)
        solution = Pull.of(path, samples, at, pull, step=STEP_FOR_POWER / power, spacing_m=spacing_m).fitted(
            aim_m, tension, spacing_m
        )
        tension = solution.tension
        path = guard.moved(path, _limited(path.nodes, solution.nodes, FARTHEST_STEP * spacing_m))
        # What the guard holds back may keep the path long: then the others have to give more.
        aim_m = min(AIM * length_m, aim_m * math.sqrt(AIM * length_m / path.length_m))


def _state(path: Polyline, weighed_m: FloatArray) -> RefinementStep:
    p95_m = float(np.quantile(weighed_m, EVENNESS_QUANTILE))
    return RefinementStep(path.line, path.length_m, float(weighed_m.max()), p95_m)


def _is_enough(state: RefinementStep, enough_m: float, length_m: float) -> bool:
    return state.largest_m <= enough_m and state.length_m <= length_m


def _better(state: RefinementStep, best: RefinementStep, length_m: float) -> RefinementStep:
    """The new state, where it fits better, or fits too and lies nearer to all water."""
    if best.length_m > length_m:
        # No path fits yet: the shorter the better, however much water it leaves.
        is_better = state.length_m < best.length_m
    else:
        is_better = state.length_m <= length_m and state.score_m < best.score_m
    return state if is_better else best


def _pull(distance_m: FloatArray, radius_m: float, power: float) -> FloatArray:
    """The weight of each sample in the least squares whose solution has the least sum of `power`-th powers."""
    return np.asarray(np.minimum(distance_m / radius_m, FARTHEST_PULL) ** (power - 2.0))


def _limited(nodes: FloatArray, target: FloatArray, most_m: float) -> FloatArray:
    """Targets no farther than `most_m` from where the nodes are."""
    step = target - nodes
    length = np.hypot(*step.T)
    return np.asarray(nodes + step * np.minimum(1.0, most_m / np.maximum(length, LEAST_M))[:, None])
