"""Fit tours into ranges: targets that are too many are taken out, and inserted where range is left."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from oxbow.arrays import FloatArray, Indices
from oxbow_assignment.targets.assignment import tour_figures, tour_length
from oxbow_assignment.targets.problem import COST, LENGTH, SUM_ROUNDING, Problem

__all__ = ["trimmed_path", "with_insertions", "with_trades"]

VALUE_ROUNDING = 1e-9
"""Differences of value below this are rounding."""

FAR_M = 1e12
"""The length of a detour that does not fit, where a finite figure is needed."""

LEAST_SAVED_S = 1e-6
"""Savings below this are rounding."""


def trimmed_path(
    problem: Problem, vehicle: int, path: Indices, *, held: int = 0, wanted: np.intp | None = None
) -> Indices:
    """A path within its vehicle's range, of targets that it may visit.

    While the path is too long, the target that saves most metres for its value is removed.

    Parameters
    ----------
    problem
        The targets, the vehicles, and the routes between them.
    vehicle
        Its index.
    path
        Rows of the problem's distances, start first and recovery last.
    held
        How many leading targets are removed last.
    wanted
        A target that is removed only after all others except the held ones; None for no such target.

    Returns
    -------
    ndarray of int
        The rows that are left, in order; start and recovery alone where no target fits.
    """
    inner = path[1:-1]
    path = np.concatenate([path[:1], inner[problem.can_visit[vehicle, inner]], path[-1:]])
    metres = problem.figures[LENGTH, vehicle]
    while tour_length(problem, vehicle, path) > problem.lengths_m[vehicle]:
        before, at, after = path[:-2], path[1:-1], path[2:]
        saved = metres[before, at] + metres[at, after] - metres[before, after]
        worth = saved / problem.values[at]
        # Removed only when nothing else is left: it is what the path was made longer for.
        worth[at == wanted] = np.finfo(float).min
        # After `wanted`: a held target stays even then.
        worth[:held] = -np.inf
        path = np.delete(path, 1 + int(worth.argmax()))
    return path


def with_insertions(problem: Problem, paths: Sequence[Indices], held: Sequence[int]) -> list[Indices]:
    """The paths with every target inserted that fits, in each step the one that costs least for its value.

    Parameters
    ----------
    problem
        The targets, the vehicles, and the routes between them.
    paths
        One per vehicle, within its range.
    held
        How many leading targets of each path stay in front.

    Returns
    -------
    list of ndarray of int
        One path per vehicle, within its range.
    """
    paths = list(paths)
    served = np.concatenate([path[1:-1] for path in paths])
    pool = np.setdiff1d(np.flatnonzero(problem.can_visit.any(axis=0)), served)
    offers = [_offers(problem, vehicle, path, held[vehicle], pool) for vehicle, path in enumerate(paths)]
    while len(pool):
        costs = np.array([offer.costs for offer in offers])
        vehicle, chosen = divmod(int(costs.argmin()), len(pool))
        if not np.isfinite(costs[vehicle, chosen]):
            break
        paths[vehicle] = np.insert(paths[vehicle], offers[vehicle].places[chosen], pool[chosen])
        pool = np.delete(pool, chosen)
        offers = [offer.without(chosen) for offer in offers]
        offers[vehicle] = _offers(problem, vehicle, paths[vehicle], held[vehicle], pool)
    return paths


def with_trades(problem: Problem, paths: Sequence[Indices], held: Sequence[int]) -> list[Indices]:
    """The paths with unserved targets in place of others, where that is worth it.

    A target is inserted although it does not fit, and others are trimmed. The change is kept if the path then
    serves more value, or as much in less time.

    Parameters
    ----------
    problem
        The targets, the vehicles, and the routes between them.
    paths
        One per vehicle, within its range.
    held
        How many leading targets of each path stay in front.

    Returns
    -------
    list of ndarray of int
        One path per vehicle; a path that is not changed is the same array as before.
    """
    paths = list(paths)
    served = np.concatenate([path[1:-1] for path in paths])
    pool = np.setdiff1d(np.flatnonzero(problem.can_visit.any(axis=0)), served)
    for target in pool[np.argsort(-problem.values[pool], kind="stable")]:
        trades = [
            _trade(problem, vehicle, paths[vehicle], held[vehicle], target)
            for vehicle in np.flatnonzero(problem.can_visit[:, target]).tolist()
        ]
        best = min(trades, key=lambda trade: (-trade.value, trade.added_s))
        # Ties change nothing: otherwise two targets could replace each other forever.
        if best.value > VALUE_ROUNDING or (best.value > -VALUE_ROUNDING and best.added_s < -LEAST_SAVED_S):
            paths[best.vehicle] = best.path
    return paths


@dataclass(frozen=True)
class _Trade:
    """A path with a target inserted and others removed: the value and the seconds that this adds."""

    vehicle: int
    path: Indices
    value: float
    added_s: float


def _trade(problem: Problem, vehicle: int, path: Indices, held: int, target: np.intp) -> _Trade:
    before, after = path[held:-1], path[held + 1 :]
    costs = problem.figures[COST, vehicle]
    detours = costs[before, target] + costs[target, after] - costs[before, after]
    longer = np.insert(path, held + 1 + int(detours.argmin()), target)
    traded = trimmed_path(problem, vehicle, longer, held=held, wanted=target)
    added_m = float((tour_figures(problem, vehicle, traded) - tour_figures(problem, vehicle, path))[COST])
    value = problem.values[traded[1:-1]].sum() - problem.values[path[1:-1]].sum()
    return _Trade(vehicle, traded, float(value), added_m / problem.vehicles[vehicle].speed_mps)


@dataclass(frozen=True)
class _Offers:
    """For each target of a pool, where one path takes it best, and at what cost; infinite if it cannot."""

    costs: FloatArray
    places: Indices

    def without(self, chosen: int) -> _Offers:
        return _Offers(np.delete(self.costs, chosen), np.delete(self.places, chosen))


def _offers(problem: Problem, vehicle: int, path: Indices, held: int, pool: Indices) -> _Offers:
    before, after, own = path[held:-1], path[held + 1 :], problem.figures[:, vehicle]
    now = tour_figures(problem, vehicle, path)
    kept = own[:, before, after] if len(path) > 2 else np.zeros((2, 1))
    added = own[:, pool[:, None], before] + own[:, pool[:, None], after] - kept[:, None]
    limit_m = problem.lengths_m[vehicle] * (1.0 - SUM_ROUNDING if len(path) > 2 else 1.0)
    fits = problem.has_role[vehicle, pool, None] & (now[LENGTH] + added[LENGTH] <= limit_m)
    detours = np.where(fits, added[COST], np.inf)
    places = detours.argmin(axis=1)
    longer = now[COST] + np.minimum(detours.min(axis=1), FAR_M)
    # The present cost at the end: its strain is what the others are compared with.
    strain = problem.strain(np.append(longer, now[COST]), np.full(len(pool) + 1, vehicle))
    costs = np.where(fits.any(axis=1), (strain[:-1] - strain[-1]) / problem.values[pool], np.inf)
    return _Offers(costs=costs, places=held + 1 + places)
