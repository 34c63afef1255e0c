"""Moves between tours: once clusters are matched and ordered, targets change vehicles where that helps.

The report stops at one tour per cluster. Three kinds of moves make up for what clustering cannot know: ranges,
speeds, where vehicles start, and the load of each. All moves of a kind that join near targets are evaluated in one
array operation. Those that gain most are made, each on tours that no other move has changed; then these tours are
put in order again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from oxbow.arrays import FloatArray, Indices
from oxbow_assignment.targets.layout import Layout
from oxbow_assignment.targets.ordering import LEAST_GAIN, SEGMENT, improved_path
from oxbow_assignment.targets.problem import COST, Problem

__all__ = ["in_order", "with_exchanges"]

NEAR = 10
"""How many near targets of each target are considered."""


def with_exchanges(problem: Problem, paths: Sequence[Indices], held: Sequence[int]) -> list[Indices]:
    """Paths between which no move lowers the objective, each within its vehicle's range.

    Parameters
    ----------
    problem
        The targets, the vehicles, and the routes between them.
    paths
        One per vehicle, within its range: rows of the problem's distances, start first and recovery last.
    held
        How many leading targets of each path stay in front.

    Returns
    -------
    list of ndarray of int
        One path per vehicle.
    """
    paths = [in_order(problem, vehicle, path, held[vehicle]) for vehicle, path in enumerate(paths)]
    # Once: which targets are near does not depend on the tours.
    near = _near(problem)
    while True:
        layout = Layout.of(problem, paths, held)
        relocations = (_relocations(layout, near, length) for length in range(1, SEGMENT + 1))
        changed = _best_apart([*relocations, _swaps(layout, near), _tails(layout, near)], layout)
        if not changed:
            return paths
        for vehicle, path in changed.items():
            paths[vehicle] = in_order(problem, vehicle, path, held[vehicle])


def in_order(problem: Problem, vehicle: int, path: Indices, held: int) -> Indices:
    """A vehicle's path improved behind its held targets; unchanged if the better one is beyond its range.

    Parameters
    ----------
    problem
        The routes.
    vehicle
        Its index.
    path
        Rows of the problem's distances, start first and recovery last.
    held
        How many leading targets stay in front.

    Returns
    -------
    ndarray of int
        The same rows.
    """
    # The leading targets stay: a vehicle under way must not be sent elsewhere.
    better = np.concatenate([path[:held], improved_path(problem.figures[COST, vehicle], path[held:])])
    return better if problem.is_within_range(vehicle, better) else path


def _near(problem: Problem) -> Indices:
    """The nearest targets of every target and of every start, shape (n + v, k)."""
    away = problem.mean_costs[: problem.count + len(problem.vehicles), : problem.count].copy()
    # No target is near itself.
    away[np.diag_indices(problem.count)] = np.inf
    k = min(NEAR, problem.count)
    return np.argsort(away, axis=1, kind="stable")[:, :k]


@dataclass(frozen=True)
class _Moves:
    """Moves of one kind: the gain of each, the two tours that it changes, and their new paths."""

    gains: FloatArray
    one: Indices
    other: Indices
    paths: Callable[[int], dict[int, Indices]]


def _best_apart(kinds: Sequence[_Moves], layout: Layout) -> dict[int, Indices]:
    """The paths that the best moves make, each on tours that no better move has changed; by vehicle."""
    costs_m = layout.totals[COST]
    least = LEAST_GAIN * float(layout.problem.strain(costs_m, np.arange(len(costs_m))).sum())
    gains = np.concatenate([moves.gains for moves in kinds])
    origin = np.concatenate([np.full(len(moves.gains), kind) for kind, moves in enumerate(kinds)])
    index = np.concatenate([np.arange(len(moves.gains)) for moves in kinds])
    # A move that gains no more than rounding might be made and undone forever.
    worth = np.flatnonzero(gains > least)
    changed: dict[int, Indices] = {}
    for best in worth[np.argsort(-gains[worth], kind="stable")].tolist():
        moves, chosen = kinds[origin[best]], int(index[best])
        if int(moves.one[chosen]) not in changed and int(moves.other[chosen]) not in changed:
            changed |= moves.paths(chosen)
    return changed


def _relocations(layout: Layout, near: Indices, length: int) -> _Moves:
    """Move a segment of `length` targets, either way round, next to a near target or to a tour's front."""
    rows, figures = layout.rows, layout.problem.figures
    at = np.flatnonzero(layout.is_free[: len(rows) - length + 1] & layout.is_free[length - 1 :])
    at = at[layout.tour[at] == layout.tour[at + length - 1]]
    joins = layout.place[np.concatenate([near[rows[at]], near[rows[at + length - 1]]], axis=1)]
    # The front of every tour, too: a tour without targets has none that could be near.
    fronts = np.broadcast_to(layout.fronts, (len(at), len(layout.fronts)))
    edges = np.concatenate([joins - 1, joins, fronts], axis=1)
    at, edges = np.repeat(at, edges.shape[1]), edges.ravel()
    # Moves within a tour are for `in_order`.
    keep = (edges >= 0) & layout.is_open[edges] & (layout.tour[edges] != layout.tour[at])
    at, edges = at[keep], edges[keep]
    end = at + length - 1
    giver, taker = layout.tour[at], layout.tour[edges]
    given = layout.totals[:, giver] - layout.between(giver, at - 1, end + 1) + layout.joint(at - 1, end + 1)
    before, after, first, last = rows[edges], rows[edges + 1], rows[at], rows[end]
    kept = figures[:, taker, before, first] + figures[:, taker, last, after]
    turned = figures[:, taker, before, last] + figures[:, taker, first, after]
    # By cost alone: where the cheaper way round is too long, the move is not made at all.
    is_turned = turned[COST] < kept[COST]
    inside = layout.between(taker, at, end)
    taken = layout.totals[:, taker] - layout.edge[:, edges] + inside + np.where(is_turned, turned, kept)
    allowed = np.logical_and.reduce([layout.problem.has_role[taker, rows[at + i]] for i in range(length)])

    def paths(index: int) -> dict[int, Indices]:
        one, other, place = int(giver[index]), int(taker[index]), int(at[index])
        moved = rows[place : place + length][:: -1 if is_turned[index] else 1]
        inner = place - layout.firsts[one]
        return {
            one: np.delete(layout.paths[one], slice(inner, inner + length)),
            other: np.insert(layout.paths[other], edges[index] - layout.firsts[other] + 1, moved),
        }

    return _Moves(layout.gains(giver, given, taker, taken, allowed), giver, taker, paths)


def _swaps(layout: Layout, near: Indices) -> _Moves:
    """Swap two near targets of different tours."""
    rows, figures = layout.rows, layout.problem.figures
    # Every free target with each of its near ones, where that one is free too and on another tour.
    at = np.flatnonzero(layout.is_free)
    with_ = layout.place[near[rows[at]]]
    at, with_ = np.repeat(at, with_.shape[1]), with_.ravel()
    keep = (with_ >= 0) & layout.is_free[with_] & (layout.tour[with_] != layout.tour[at])
    at, with_ = at[keep], with_[keep]
    one, other = layout.tour[at], layout.tour[with_]

    # A tour's figures with another target in the place of its own; the neighbours stay.
    def changed(here: Indices, target: Indices) -> FloatArray:
        owner, left, right = layout.tour[here], rows[here - 1], rows[here + 1]
        added: FloatArray = figures[:, owner, left, target] + figures[:, owner, target, right]
        return layout.totals[:, owner] + added - layout.edge[:, here - 1] - layout.edge[:, here]

    def paths(index: int) -> dict[int, Indices]:
        swapped = {}
        for here, there in ((at[index], with_[index]), (with_[index], at[index])):
            tour = int(layout.tour[here])
            swapped[tour] = layout.paths[tour].copy()
            swapped[tour][here - layout.firsts[tour]] = rows[there]
        return swapped

    # Each has to be able to do what the other did.
    allowed = layout.problem.has_role[one, rows[with_]] & layout.problem.has_role[other, rows[at]]
    gains = layout.gains(one, changed(at, rows[with_]), other, changed(with_, rows[at]), allowed)
    return _Moves(gains, one, other, paths)


def _tails(layout: Layout, near: Indices) -> _Moves:
    """Cut two tours and exchange what follows, so that near targets meet: 2-opt*.

    J.-Y. Potvin and J.-M. Rousseau (1995). Each vehicle still ends at its own recovery. Both vehicles must be able
    to take the same targets by their roles.
    """
    # Cut behind any row, and go on with a near target of another tour: its predecessor goes on with the tail that
    # was cut off.
    cut = np.flatnonzero(layout.is_open & (layout.rows < len(near)))
    join = layout.place[near[layout.rows[cut]]]
    cut, join = np.repeat(cut, join.shape[1]), join.ravel()
    keep = (join >= 0) & layout.is_open[join - 1] & (layout.tour[join] != layout.tour[cut])
    cut, join = cut[keep], join[keep]
    one, other = layout.tour[cut], layout.tour[join]
    new_one, new_other = _spliced(layout, cut, join), _spliced(layout, join - 1, cut + 1)

    def paths(index: int) -> dict[int, Indices]:
        tours = int(one[index]), int(other[index])
        first, second = (layout.paths[tour] for tour in tours)
        i, j = cut[index] + 1 - layout.firsts[tours[0]], join[index] - layout.firsts[tours[1]]
        spliced = (
            np.concatenate([first[:i], second[j:-1], first[-1:]]),
            np.concatenate([second[:j], first[i:-1], second[-1:]]),
        )
        return dict(zip(tours, spliced, strict=True))

    has_role = layout.problem.has_role
    # Tails are exchanged whole: it would take too long to check the role for each of their targets.
    alike = (has_role[:, None] == has_role[None, :]).all(axis=2)
    return _Moves(layout.gains(one, new_one, other, new_other, alike[one, other]), one, other, paths)


def _spliced(layout: Layout, head: Indices, tail: Indices) -> FloatArray:
    """Figures of paths up to the places `head`, then along other paths from `tail`, then to their own recovery."""
    figures, rows, owner = layout.problem.figures, layout.rows, layout.tour[head]
    recovery, last = layout.lasts[owner], layout.lasts[layout.tour[tail]] - 1
    before = layout.between(owner, layout.firsts[owner], head)
    over = figures[:, owner, rows[head], rows[tail]] + layout.between(owner, tail, last)
    over += figures[:, owner, rows[last], rows[recovery]]
    return np.asarray(before + np.where(tail <= last, over, layout.joint(head, recovery)))
