"""Moves between tours: once clusters are matched and ordered, targets change vehicles where that helps.

The report stops at one tour a cluster. The three moves here mend what clustering cannot know: ranges, speeds,
where vehicles start, and the load of each. All moves of a kind that join near targets are weighed in one array
operation; those that gain most are made, each on tours that no other has touched; then these tours are put in
order again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from oxbow.contracts import FloatArray
from oxbow_assignment.layout import Layout
from oxbow_assignment.ordering import LEAST_GAIN, SEGMENT, improved_path
from oxbow_assignment.problem import IntArray, Problem

__all__ = ["exchanged", "in_order"]

NEAR = 10
"""How many near targets of each target are looked at."""


def exchanged(problem: Problem, paths: Sequence[IntArray], held: Sequence[int]) -> list[IntArray]:
    """Paths between which no move lowers the objective, each within its vehicle's range.

    Parameters
    ----------
    paths
        One a vehicle, within its range: rows of the problem's distances, start first and recovery last.
    held
        How many leading targets of each path stay in front.
    """
    paths = [in_order(problem, path, kept) for path, kept in zip(paths, held, strict=True)]
    near = _near(problem)
    while True:
        layout = Layout.of(problem, paths, held)
        made = dict(_made([kind(layout, near) for kind in (_relocations, _swaps, _tails)], layout))
        if not made:
            return paths
        for vehicle, path in made.items():
            paths[vehicle] = in_order(problem, path, held[vehicle])


def in_order(problem: Problem, path: IntArray, held: int) -> IntArray:
    """A path improved behind its held targets."""
    return np.concatenate([path[:held], improved_path(problem.finite, path[held:])])


def _near(problem: Problem) -> IntArray:
    """The nearest targets of every target and of every start, shape (n + v, k)."""
    away = problem.finite[: problem.count + len(problem.vehicles), : problem.count].copy()
    away[np.diag_indices(problem.count)] = np.inf
    k = min(NEAR, problem.count)
    return np.argsort(away, axis=1, kind="stable")[:, :k]


@dataclass(frozen=True)
class _Moves:
    """Moves of one kind: what each gains, the two tours it changes, and the two paths that it makes."""

    gains: FloatArray
    one: IntArray
    other: IntArray
    paths: Callable[[int], tuple[IntArray, IntArray]]


def _made(kinds: Sequence[_Moves], layout: Layout) -> Iterator[tuple[int, IntArray]]:
    """The paths that the best moves make, each on tours that no better one has touched."""
    least = LEAST_GAIN * float(layout.problem.strain(layout.lengths_m, np.arange(len(layout.lengths_m))).sum())
    gains = np.concatenate([moves.gains for moves in kinds])
    origin = np.concatenate([np.full(len(moves.gains), kind) for kind, moves in enumerate(kinds)])
    index = np.concatenate([np.arange(len(moves.gains)) for moves in kinds])
    untouched = np.ones(len(layout.lengths_m), dtype=bool)
    worth = np.flatnonzero(gains > least)
    for best in worth[np.argsort(-gains[worth], kind="stable")].tolist():
        moves, chosen = kinds[origin[best]], int(index[best])
        tours = [int(moves.one[chosen]), int(moves.other[chosen])]
        if untouched[tours].all():
            untouched[tours] = False
            yield from zip(tours, moves.paths(chosen), strict=True)


def _relocations(layout: Layout, near: IntArray) -> _Moves:
    """Move a segment of up to `SEGMENT` targets, either way round, next to a near target or to a tour's front."""
    parts = [_relocations_of(layout, near, length) for length in range(1, SEGMENT + 1)]
    gains, segment, edge, turned = (np.concatenate(column) for column in zip(*parts, strict=True))
    size = np.repeat(np.arange(1, SEGMENT + 1), [len(part[0]) for part in parts])

    def paths(index: int) -> tuple[IntArray, IntArray]:
        at, length, onto = int(segment[index]), int(size[index]), int(edge[index])
        moved = layout.rows[at : at + length][:: -1 if turned[index] else 1]
        giver, taker = layout.tour[at], layout.tour[onto]
        inner = at - layout.firsts[giver]
        given = np.delete(layout.paths[giver], slice(inner, inner + length))
        return given, np.insert(layout.paths[taker], onto - layout.firsts[taker] + 1, moved)

    return _Moves(gains, layout.tour[segment], layout.tour[edge], paths)


def _relocations_of(
    layout: Layout, near: IntArray, length: int
) -> tuple[FloatArray, IntArray, IntArray, IntArray]:
    """Of all moves of segments of one length: gain, places of segment and edge, and whether it is turned."""
    rows, metres = layout.rows, layout.problem.finite
    at = np.flatnonzero(layout.is_free[: len(rows) - length + 1] & layout.is_free[length - 1 :])
    at = at[layout.tour[at] == layout.tour[at + length - 1]]
    joins = layout.place[np.concatenate([near[rows[at]], near[rows[at + length - 1]]], axis=1)]
    fronts = np.broadcast_to(layout.fronts, (len(at), len(layout.fronts)))
    edges = np.concatenate([joins - 1, joins, fronts], axis=1)
    at, edges = np.repeat(at, edges.shape[1]), edges.ravel()
    keep = (edges >= 0) & layout.is_open[edges] & (layout.tour[edges] != layout.tour[at])
    at, edges = at[keep], edges[keep]
    end = at + length - 1
    giver, taker = layout.tour[at], layout.tour[edges]
    inside_m = layout.along_m[end] - layout.along_m[at]
    given_m = (
        layout.lengths_m[giver]
        - (layout.along_m[end + 1] - layout.along_m[at - 1])
        + layout.joint_m(at - 1, end + 1)
    )
    before, after, first, last = rows[edges], rows[edges + 1], rows[at], rows[end]
    kept_m = metres[before, first] + metres[last, after]
    turned_m = metres[before, last] + metres[first, after]
    taken_m = layout.lengths_m[taker] - layout.edge_m[edges] + inside_m + np.minimum(kept_m, turned_m)
    allowed = np.logical_and.reduce([layout.problem.has_role[taker, rows[at + i]] for i in range(length)])
    return layout.gains(giver, given_m, taker, taken_m, allowed), at, edges, (turned_m < kept_m).astype(np.intp)


def _swaps(layout: Layout, near: IntArray) -> _Moves:
    """Let two near targets of different tours take each other's place."""
    rows, metres = layout.rows, layout.problem.finite
    at = np.flatnonzero(layout.is_free)
    with_ = layout.place[near[rows[at]]]
    at, with_ = np.repeat(at, with_.shape[1]), with_.ravel()
    keep = (with_ >= 0) & layout.is_free[with_] & (layout.tour[with_] != layout.tour[at])
    at, with_ = at[keep], with_[keep]
    one, other = layout.tour[at], layout.tour[with_]

    def length(here: IntArray, target: IntArray) -> FloatArray:
        left, right = rows[here - 1], rows[here + 1]
        changed: FloatArray = metres[left, target] + metres[target, right] - layout.edge_m[here - 1]
        return layout.lengths_m[layout.tour[here]] + changed - layout.edge_m[here]

    def paths(index: int) -> tuple[IntArray, IntArray]:
        here, there = int(at[index]), int(with_[index])
        first, second = layout.paths[one[index]].copy(), layout.paths[other[index]].copy()
        first[here - layout.firsts[one[index]]] = rows[there]
        second[there - layout.firsts[other[index]]] = rows[here]
        return first, second

    allowed = layout.problem.has_role[one, rows[with_]] & layout.problem.has_role[other, rows[at]]
    gains = layout.gains(one, length(at, rows[with_]), other, length(with_, rows[at]), allowed)
    return _Moves(gains, one, other, paths)


def _tails(layout: Layout, near: IntArray) -> _Moves:
    """Cut two tours and exchange what follows, so that near targets meet: 2-opt*.

    J.-Y. Potvin and J.-M. Rousseau (1995). Each vehicle still ends at its own recovery. Vehicles must have the
    same role for every target.
    """
    rows, metres, along_m = layout.rows, layout.problem.finite, layout.along_m
    cut = np.flatnonzero(layout.is_open & (rows < near.shape[0]))
    join = layout.place[near[rows[cut]]]
    cut, join = np.repeat(cut, join.shape[1]), join.ravel()
    keep = (join >= 0) & layout.is_open[join - 1] & (layout.tour[join] != layout.tour[cut])
    cut, join = cut[keep], join[keep]
    one, other = layout.tour[cut], layout.tour[join]
    one_end, other_end = layout.lasts[one], layout.lasts[other]
    one_m = (
        along_m[cut]
        + metres[rows[cut], rows[join]]
        + (along_m[other_end - 1] - along_m[join])
        + metres[rows[other_end - 1], rows[one_end]]
    )
    has_tail = cut + 1 < one_end
    tail_m = (
        metres[rows[join - 1], rows[cut + 1]]
        + (along_m[one_end - 1] - along_m[cut + 1])
        + metres[rows[one_end - 1], rows[other_end]]
    )
    is_empty = join - 1 == layout.firsts[other]
    headed_m = np.where(is_empty, 0.0, along_m[join - 1] + metres[rows[join - 1], rows[other_end]])
    other_m = np.where(has_tail, along_m[join - 1] + tail_m, headed_m)
    has_role = layout.problem.has_role
    alike = (has_role[:, None] == has_role[None, :]).all(axis=2)

    def paths(index: int) -> tuple[IntArray, IntArray]:
        first, second = layout.paths[one[index]], layout.paths[other[index]]
        i, j = cut[index] + 1 - layout.firsts[one[index]], join[index] - layout.firsts[other[index]]
        return (
            np.concatenate([first[:i], second[j:-1], first[-1:]]),
            np.concatenate([second[:j], first[i:-1], second[-1:]]),
        )

    return _Moves(layout.gains(one, one_m, other, other_m, alike[one, other]), one, other, paths)
