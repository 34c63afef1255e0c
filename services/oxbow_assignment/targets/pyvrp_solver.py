"""The joint problem in PyVRP's terms (N. A. Wouda, L. Lan and W. Kool, 2024): the only module that imports it.

PyVRP counts in integers: centimetres and hundredths of a second, rounded up, so that what fits in PyVRP fits.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pyvrp import Client, Depot, Location, ProblemData, Solution, VehicleType, solve
from pyvrp.stop import NoImprovement

from oxbow.arrays import FloatArray, Indices
from oxbow_assignment.targets.problem import COST, LENGTH, Problem

__all__ = ["solve_with_pyvrp"]

PER_UNIT = 100
"""PyVRP's units per metre, and per second."""

PRIZE = 2.0
"""The least value weighs this many times the duration of all ranges together, so that value comes first."""


def solve_with_pyvrp(
    problem: Problem, *, patience: int, seed: int, within_s: float | None = None
) -> list[Indices]:
    """Paths of least total duration, one per vehicle, among those that serve the greatest value.

    Parameters
    ----------
    problem
        The targets, the vehicles, and the routes between them.
    patience
        Iterations without improvement after which the search ends.
    seed
        Seed of the search.
    within_s
        The longest that any vehicle may take, in seconds; by default only its range limits it.

    Returns
    -------
    list of ndarray of int
        Rows of the problem's distances, start first and recovery last.
    """
    data = _data(problem, within_s)
    result = solve(data, NoImprovement(patience), seed=seed, collect_stats=False, display=False)
    return _paths(problem, result.best)


def _data(problem: Problem, within_s: float | None) -> ProblemData:
    lengths, count = problem.lengths_m, len(problem.vehicles)
    longest_s = float((lengths / problem.speeds_mps).sum()) + _most_danger_s(problem)
    # So large that no saving of time is worth a target of the least value.
    prizes = _steps(PRIZE * longest_s * problem.values / problem.values.min(initial=np.inf))
    far_m = 2.0 * max(float(lengths.max()), float(problem.figures.max()))
    metres, seconds = [], []
    for vehicle, speed_mps in enumerate(problem.speeds_mps):
        own = problem.figures[:, vehicle].copy()
        # PyVRP has no pairs of vehicle and client that are forbidden: such a client lies beyond every range.
        barred = np.flatnonzero(~problem.has_role[vehicle])
        own[:, barred], own[:, :, barred] = far_m, far_m
        own[:, np.arange(own.shape[1]), np.arange(own.shape[1])] = 0.0
        metres.append(_steps(own[LENGTH]))
        seconds.append(_steps(own[COST] / speed_mps))
    types = [
        VehicleType(
            start_depot=vehicle,
            end_depot=count + vehicle,
            max_distance=int(lengths[vehicle] * PER_UNIT),
            unit_distance_cost=0,
            unit_duration_cost=1,
            shift_duration=int(PER_UNIT * (longest_s if within_s is None else within_s)),
            profile=vehicle,
        )
        for vehicle in range(count)
    ]
    return ProblemData(
        locations=[Location(0, 0)] * problem.figures.shape[-1],
        clients=[Client(target, prize=prize, required=False) for target, prize in enumerate(prizes.tolist())],
        depots=[Depot(row) for row in [*problem.starts.tolist(), *problem.recoveries.tolist()]],
        vehicle_types=types,
        distance_matrices=metres,
        duration_matrices=seconds,
    )


def _most_danger_s(problem: Problem) -> float:
    """An upper bound of the price of all danger: the costliest route from each place, for the slowest vehicle."""
    danger_m = (problem.figures[COST] - problem.figures[LENGTH]).max(axis=(0, 1))
    return float(danger_m.sum() / problem.speeds_mps.min())


def _steps(figures: FloatArray) -> Any:
    return np.ceil(figures * PER_UNIT).astype(np.int64)


def _paths(problem: Problem, solution: Solution) -> list[Indices]:
    tours: list[list[int]] = [[] for _ in problem.vehicles]
    for route in solution.routes():
        tours[route.vehicle_type()] = [stop.idx for stop in route if stop.is_client()]
    return [problem.path(vehicle, tour) for vehicle, tour in enumerate(tours)]
