"""Reassign what is left when a vehicle is lost or a target is new, without sending vehicles back and forth.

The Hungarian method alone may turn a vehicle round before it has visited anything (Innocenti, Pollini and
Bracci 2006, section 4.2). So a vehicle keeps its current target, the first of its tour, unless giving it up gains
more than a hysteresis.

This is for replans on the way; no mission uses it yet.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from oxbow.arrays import Indices
from oxbow.errors import InvalidRequest
from oxbow_assignment.targets.assign import mended_paths
from oxbow_assignment.targets.assignment import TargetAssignment, assignment_of
from oxbow_assignment.targets.insertion import trimmed_path
from oxbow_assignment.targets.problem import Problem

__all__ = ["Reassignment", "reassign"]


@dataclass(frozen=True)
class Reassignment:
    """An assignment of what is left.

    Parameters
    ----------
    assignment
        The new tours.
    kept
        The assignment in which every vehicle keeps its current target, if that is still within reach.
    changed
        Names of the vehicles that give up a current target that they could have kept.
    """

    assignment: TargetAssignment
    kept: TargetAssignment
    changed: tuple[str, ...]


def reassign(problem: Problem, tours: Sequence[Sequence[int]], *, hysteresis_s: float) -> Reassignment:
    """Reassign the targets that are left.

    A lost vehicle is one that `problem` no longer has; a new target is one that is in no tour. First all vehicles
    keep their current targets, and the rest is reassigned. Then vehicles are freed, all at once or one after
    another. That is kept if it serves more value, or lowers the objective by more than `hysteresis_s` for each
    current target that changes.

    Parameters
    ----------
    problem
        What is left: vehicles where they are now, with the range that remains, and targets not yet visited.
    tours
        For each vehicle of the problem, the targets that it was to visit, in order; targets of this problem.
    hysteresis_s
        What each change of a current target must gain, in seconds of the objective; >= 0.

    Returns
    -------
    Reassignment
        With the assignment that keeps all current targets, for comparison.

    Raises
    ------
    InvalidRequest
        The tours do not fit the problem, or the hysteresis is negative or not a number.
    """
    if not hysteresis_s >= 0.0:
        raise InvalidRequest(f"is {hysteresis_s!r} s; expected a number >= 0", where="hysteresis_s")
    _require_tours(problem, tours)
    paths = [
        trimmed_path(problem, vehicle, problem.path(vehicle, tour), held=1) for vehicle, tour in enumerate(tours)
    ]
    current = tuple(
        tour[0] if len(tour) and _first(path) == tour[0] else None for path, tour in zip(paths, tours, strict=True)
    )
    bound = frozenset(vehicle for vehicle, target in enumerate(current) if target is not None)
    # At first every vehicle keeps its current target; each round lets one more change, or all, if that pays.
    kept = best = _Candidate.of(problem, paths, bound, current)
    while best.bound:
        # All at once too: two vehicles that should swap their targets gain nothing when only one is freed.
        freed = [frozenset(), *(best.bound - {vehicle} for vehicle in sorted(best.bound))]
        found = min(
            (_Candidate.of(problem, best.paths, bound, current) for bound in freed),
            key=lambda candidate: candidate.rank(hysteresis_s),
        )
        # Strictly better each round, or the same candidates would come round for ever.
        if found.rank(hysteresis_s) >= best.rank(hysteresis_s):
            break
        best = found
    names = tuple(problem.vehicles[vehicle].name for vehicle in best.changed)
    return Reassignment(assignment=best.assignment, kept=kept.assignment, changed=names)


@dataclass(frozen=True)
class _Candidate:
    """Paths on which the vehicles in `bound` keep their current target."""

    paths: Sequence[Indices]
    bound: frozenset[int]
    assignment: TargetAssignment
    changed: tuple[int, ...]

    @classmethod
    def of(
        cls,
        problem: Problem,
        paths: Sequence[Indices],
        bound: frozenset[int],
        current: Sequence[int | None],
    ) -> _Candidate:
        paths = mended_paths(problem, paths, [int(vehicle in bound) for vehicle in range(len(paths))])
        changed = tuple(
            vehicle
            for vehicle, (path, target) in enumerate(zip(paths, current, strict=True))
            if target is not None and _first(path) != target
        )
        return cls(paths, bound, assignment_of(problem, paths), changed)

    def rank(self, hysteresis_s: float) -> tuple[float, float]:
        """Value first; then the objective, plus the hysteresis for each change. Less is better."""
        return -self.assignment.value, self.assignment.cost_s + hysteresis_s * len(self.changed)


def _first(path: Indices) -> int | None:
    """The first target of a path."""
    return int(path[1]) if len(path) > 2 else None


def _require_tours(problem: Problem, tours: Sequence[Sequence[int]]) -> None:
    if len(tours) != len(problem.vehicles):
        raise InvalidRequest(f"has {len(tours)}; expected {len(problem.vehicles)}, one per vehicle", where="tours")
    for target, times in Counter(target for tour in tours for target in tour).items():
        if not 0 <= target < problem.count:
            raise InvalidRequest(f"has target {target}; expected 0 to {problem.count - 1}", where="tours")
        if times > 1:
            raise InvalidRequest(f"visits target {target} {times} times; expected once", where="tours")
