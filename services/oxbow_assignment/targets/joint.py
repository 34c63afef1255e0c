"""The joint optimiser: targets, vehicles and orders at once, and the gap that clusters leave to it.

This goes beyond the report, which clusters because the joint problem is NP-hard (Innocenti, Pollini and Bracci
2006, section 4.1). It needs the optional extra ``fleet`` (PyVRP).
"""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass

from oxbow.errors import Unavailable
from oxbow_assignment.targets.assign import Clustered, Clustering, assign
from oxbow_assignment.targets.assignment import TargetAssignment, assignment_of
from oxbow_assignment.targets.problem import Objective, Problem

__all__ = ["PATIENCE", "Gap", "JointSolution", "gap_to", "is_available", "optimise", "solve"]

PATIENCE = 2_000
"""Iterations without improvement after which a search ends: a few seconds for 60 targets."""

PRECISION = 0.005
"""Bisection ends when the longest makespan not reached is within this fraction of the shortest one reached."""

MISSING = "PyVRP, of the optional extra fleet, is not installed: pip install 'oxbow[fleet]'"
NOT_ASKED = "the joint optimiser was not asked for"


@dataclass(frozen=True)
class Gap:
    """How much more an assignment costs than the joint optimiser's.

    Parameters
    ----------
    relative
        The excess as a fraction of the joint optimiser's cost: 0.05 is 5 % more, below 0 is better than it. None
        if there is no such figure.
    reason
        Why there is none; empty if there is one.
    """

    relative: float | None
    reason: str = ""


@dataclass(frozen=True)
class JointSolution:
    """The clustered assignment, the joint one if there is one, and the gap between them."""

    clustered: Clustered
    joint: TargetAssignment | None
    gap: Gap

    @property
    def best(self) -> TargetAssignment:
        """Whichever of the two serves more value, or the same value at less cost."""
        if self.joint is None:
            return self.clustered.assignment
        return min(self.clustered.assignment, self.joint, key=lambda found: found.rank)

    @property
    def best_gap(self) -> Gap:
        """The gap between the best and the joint one: 0 if the joint one is the best, below 0 if it is not."""
        return self.gap if self.joint is None else gap_to(self.best, self.joint)


def solve(
    problem: Problem, clustering: Clustering | None = None, *, patience: int | None = PATIENCE, seed: int = 0
) -> JointSolution:
    """Assign by clusters, and compare that with the joint optimiser.

    Parameters
    ----------
    problem, clustering
        See `assign`.
    patience, seed
        See `optimise`; the joint optimiser does not run if `patience` is None.

    Returns
    -------
    JointSolution
        Without a joint assignment where PyVRP is missing or was not asked for; its gap says which.
    """
    clustered = assign(problem, clustering)
    if patience is None or not is_available():
        return JointSolution(clustered, None, Gap(None, NOT_ASKED if patience is None else MISSING))
    joint = optimise(problem, patience=patience, seed=seed)
    return JointSolution(clustered, joint, gap_to(clustered.assignment, joint))


def is_available() -> bool:
    """Whether the optional extra is installed."""
    return importlib.util.find_spec("pyvrp") is not None


def optimise(problem: Problem, *, patience: int = PATIENCE, seed: int = 0) -> TargetAssignment:
    """The best assignment that PyVRP's iterated local search finds; ranges are capacities.

    A search ends by iterations, not by time: the same problem and seed give the same assignment. PyVRP cannot
    minimise a makespan; the longest duration allowed is bisected instead, between what was reached and what was
    not.

    Parameters
    ----------
    problem
        The targets, the vehicles, and the routes between them.
    patience
        Iterations without improvement after which a search ends.
    seed
        Seed of the search.

    Returns
    -------
    TargetAssignment
        At least as good as any that a search met on the way.

    Raises
    ------
    Unavailable
        PyVRP is not installed.
    """
    if not is_available():
        raise Unavailable(MISSING, where="joint")
    from oxbow_assignment.targets.pyvrp_solver import solve_with_pyvrp  # noqa: PLC0415 (an optional dependency)

    best = assignment_of(problem, solve_with_pyvrp(problem, patience=patience, seed=seed))
    if problem.objective is Objective.TOTAL:
        return best
    missed_s = 0.0
    while best.cost_s - missed_s > PRECISION * best.cost_s:
        within_s = (best.cost_s + missed_s) / 2
        found = assignment_of(problem, solve_with_pyvrp(problem, patience=patience, seed=seed, within_s=within_s))
        # A makespan counts as reached only if the same value is served: by leaving targets, any can be.
        if found.value == best.value and found.cost_s < best.cost_s:
            best = found
        else:
            missed_s = within_s
    return best


def gap_to(assignment: TargetAssignment, joint: TargetAssignment) -> Gap:
    """The gap between two assignments of one problem, if they serve the same value.

    Parameters
    ----------
    assignment
        What is compared.
    joint
        What the joint optimiser found.

    Returns
    -------
    Gap
        Without a figure where the two serve different values.
    """
    if assignment.value != joint.value:
        return Gap(None, f"clusters serve targets worth {assignment.value:g}, the joint optimiser {joint.value:g}")
    if assignment.cost_s == joint.cost_s:  # both may be 0
        return Gap(0.0)
    return Gap(assignment.cost_s / joint.cost_s - 1.0)
