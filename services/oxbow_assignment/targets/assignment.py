"""Assignments: which vehicle visits which targets, in which order, and at what cost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from oxbow.arrays import FloatArray, Indices
from oxbow_assignment.targets.problem import COST, LENGTH, Objective, Problem

__all__ = ["TargetAssignment", "Unserved", "VehicleTour", "assignment_of", "tour_figures", "tour_length"]


@dataclass(frozen=True)
class VehicleTour:
    """What one vehicle does: its targets in order, from its start to its recovery.

    A vehicle without targets stays where it is: 0 m. `cost_s` is its duration plus the price of danger on its way.
    """

    vehicle: str
    targets: tuple[int, ...]
    length_m: float
    duration_s: float
    cost_s: float


@dataclass(frozen=True)
class Unserved:
    """A target that no vehicle visits, and why.

    Parameters
    ----------
    target
        Its index.
    detour_m
        The least by which it would lengthen the tour of a vehicle with its role, in metres; infinite without such
        a vehicle or route.
    reason
        What is missing: a role, range, or range left beside the other targets.
    """

    target: int
    detour_m: float
    reason: str


@dataclass(frozen=True)
class TargetAssignment:
    """Tours, one per vehicle, each within its vehicle's range; every target is in one tour or unserved.

    Parameters
    ----------
    tours
        In the order of the problem's vehicles.
    unserved
        Targets that no vehicle visits, in ascending order.
    objective
        What the assignment minimises.
    value
        The summed value of the targets that are visited.
    """

    tours: tuple[VehicleTour, ...]
    unserved: tuple[Unserved, ...]
    objective: Objective
    value: float

    @property
    def total_length_m(self) -> float:
        return sum(tour.length_m for tour in self.tours)

    @property
    def total_duration_s(self) -> float:
        return sum(tour.duration_s for tour in self.tours)

    @property
    def makespan_s(self) -> float:
        """When the last vehicle is done."""
        return max(tour.duration_s for tour in self.tours)

    @property
    def cost_s(self) -> float:
        """The objective."""
        costs = [tour.cost_s for tour in self.tours]
        return max(costs) if self.objective is Objective.MAKESPAN else sum(costs)

    @property
    def rank(self) -> tuple[float, float]:
        """Less is better: value first, then cost."""
        return -self.value, self.cost_s


def tour_figures(problem: Problem, vehicle: int, path: Indices) -> FloatArray:
    """Cost and length of one vehicle's path, shape (2,), in metres; 0 without targets.

    Parameters
    ----------
    problem
        The routes.
    vehicle
        Its index.
    path
        Rows of the problem's distances, start first and recovery last.

    Returns
    -------
    ndarray of float, shape (2,)
        At `COST` and `LENGTH`.
    """
    if len(path) <= 2:
        return np.zeros(2)
    return np.asarray(problem.figures[:, vehicle, path[:-1], path[1:]].sum(axis=1))


def tour_length(problem: Problem, vehicle: int, path: Indices) -> float:
    """Length of one vehicle's path, in metres; 0 without targets.

    Parameters
    ----------
    problem, vehicle, path
        See `tour_figures`.

    Returns
    -------
    float
        In metres.
    """
    return float(tour_figures(problem, vehicle, path)[LENGTH])


def assignment_of(problem: Problem, paths: Sequence[Indices]) -> TargetAssignment:
    """The assignment in which each vehicle travels its path.

    Parameters
    ----------
    problem
        The targets, the vehicles, and the routes between them.
    paths
        One per vehicle: rows of the problem's distances, start first and recovery last.

    Returns
    -------
    TargetAssignment
        Ranges are not checked: whoever made the paths has kept to them.
    """
    figures = np.array([tour_figures(problem, vehicle, path) for vehicle, path in enumerate(paths)])
    tours = tuple(
        VehicleTour(
            vehicle=vehicle.name,
            targets=tuple(path[1:-1].tolist()),
            length_m=float(own[LENGTH]),
            duration_s=float(own[LENGTH]) / vehicle.speed_mps,
            cost_s=float(own[COST]) / vehicle.speed_mps,
        )
        for vehicle, path, own in zip(problem.vehicles, paths, figures, strict=True)
    )
    # Summed in order of targets, so that rounding gives the same targets the same value, whoever visits them.
    served = np.array(sorted(target for tour in tours for target in tour.targets), dtype=int)
    left = np.setdiff1d(np.arange(problem.count), served)
    return TargetAssignment(
        tours=tours,
        unserved=_unserved(problem, paths, figures[:, LENGTH], left),
        objective=problem.objective,
        value=float(problem.values[served].sum()),
    )


def _unserved(
    problem: Problem, paths: Sequence[Indices], lengths: FloatArray, left: Indices
) -> tuple[Unserved, ...]:
    found = [_detours(problem, vehicle, path, left) for vehicle, path in enumerate(paths)]
    detours = np.array(found).reshape(len(paths), len(left))
    detours = np.where(problem.has_role[:, left], detours, np.inf)
    return tuple(
        Unserved(target=target, detour_m=float(own.min()), reason=_reason(problem, target, own, lengths))
        for target, own in zip(left.tolist(), detours.T, strict=True)
    )


def _detours(problem: Problem, vehicle: int, path: Indices, targets: Indices) -> FloatArray:
    """The least by which each target would lengthen a vehicle's path, in metres, shape (n,)."""
    away = problem.lengths[vehicle][np.ix_(targets, path)]
    known = problem.figures[LENGTH, vehicle, path[:-1], path[1:]] if len(path) > 2 else np.zeros(1)
    detours: FloatArray = (away[:, :-1] + away[:, 1:] - known).min(axis=1)
    return detours


def _reason(problem: Problem, target: int, detours: FloatArray, lengths: FloatArray) -> str:
    if not problem.has_role[:, target].any():
        return f"asks for a {problem.roles[target]}, and no vehicle is one"
    if not problem.can_visit[:, target].any():
        short = np.where(
            problem.has_role[:, target], problem.there_and_back_m[:, target] - problem.lengths_m, np.inf
        )
        nearest = int(short.argmin())
        if not np.isfinite(short[nearest]):
            return "no route leads to it from any vehicle with its role"
        return (
            f"out of every vehicle's reach: {problem.vehicles[nearest].name!r} would travel"
            f" {problem.there_and_back_m[nearest, target]:.0f} m and may travel {problem.lengths_m[nearest]:.0f} m"
        )
    # Not the least detour, but the one that exceeds what is left of its vehicle's range by least.
    nearest = int((detours - (problem.lengths_m - lengths)).argmin())
    return (
        f"no range left: it would lengthen the tour of {problem.vehicles[nearest].name!r} by"
        f" {detours[nearest]:.0f} m, and {problem.lengths_m[nearest] - lengths[nearest]:.0f} m are left"
    )
