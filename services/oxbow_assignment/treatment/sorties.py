"""Sorties: which slave treats which parts in which order, in as many rounds as needed, and the path of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from shapely import LineString

from oxbow.arrays import FloatArray, Indices
from oxbow.errors import Internal
from oxbow.tolerances import ROUNDING_M
from oxbow_assignment.targets.assign import Clustering
from oxbow_assignment.targets.joint import JointSolution, solve
from oxbow_assignment.targets.problem import COST, LENGTH, Objective, Problem
from oxbow_assignment.treatment.division import Part
from oxbow_assignment.treatment.fleet import Fleet, FleetWays
from oxbow_assignment.treatment.lines import chained_line

__all__ = ["Journey", "Schedule", "schedule_sorties"]

JOINT_MOST = 30
"""The joint optimiser is not run on more parts than this: it would take longer than everything else."""

PATIENCE = 100
"""Patience of the joint optimiser; with more, it finds nothing better for so few parts."""


@dataclass(frozen=True)
class Journey:
    """What one slave does from its start to its recovery.

    Parameters
    ----------
    slave
        Its index.
    parts
        Indices of the parts that it treats, in order.
    path
        The leg out, routes and parts in alternation, and the leg home.
    routes
        The routes of the path, which treat nothing.
    """

    slave: int
    parts: tuple[int, ...]
    path: LineString
    routes: tuple[LineString, ...]


@dataclass(frozen=True)
class Schedule:
    """The journeys that treat all parts, in rounds; each slave goes out at most once in a round.

    Parameters
    ----------
    rounds
        The journeys of each round, in order of the slaves.
    first
        The assignment of the first round, with its gap to the joint optimiser; None without parts.
    """

    rounds: tuple[tuple[Journey, ...], ...]
    first: JointSolution | None


def schedule_sorties(parts: Sequence[Part], fleet: Fleet, *, seed: int = 0) -> Schedule:
    """Assign parts to slaves, round after round, so that each round treats as much value as it can.

    A part is a target whose two ends are apart. Between parts, the problem counts the mean of the ways from either
    end of one to either end of the other, and half the length of both. It thus counts a tour as the mean over all
    ways to orient its parts: the cheapest orientation costs no more, and the shortest is within range.

    Parameters
    ----------
    parts
        Each fits the range of at least one slave.
    fleet
        The slaves.
    seed
        Seed of the clustering and of the joint optimiser.

    Returns
    -------
    Schedule
        Every part is in exactly one journey.

    Raises
    ------
    Internal
        A sortie would break a rule, or a part that fits was left: a fault of the planner.
    """
    if not parts:
        return Schedule((), None)
    ways = fleet.ways([part.line for part in parts], [part.spot for part in parts])
    left = np.arange(len(parts))
    rounds: list[tuple[Journey, ...]] = []
    first: JointSolution | None = None
    while len(left):
        # In the first round only: that is what goes out now, and what `first` is compared by.
        patience = PATIENCE if first is None and len(left) <= JOINT_MOST else None
        solution = solve(_problem(parts, fleet, ways, left), Clustering(seed=seed), patience=patience, seed=seed)
        first = first or solution
        tours = [left[list(tour.targets)] for tour in solution.best.tours]
        rounds.append(
            tuple(_journey(slave, tour, parts, fleet, ways) for slave, tour in enumerate(tours) if len(tour))
        )
        if not rounds[-1]:
            raise Internal(f"{len(left)} parts that fit the range of a slave were left", where="sorties")
        left = np.setdiff1d(left, np.concatenate(tours))
    return Schedule(tuple(rounds), first)


def _problem(parts: Sequence[Part], fleet: Fleet, ways: FleetWays, left: Indices) -> Problem:
    """The problem of what is left: mean ways between parts, with half of the parts' lengths on either side."""
    count, boats = len(left), len(fleet.slaves)
    rows = count + 2 * boats
    half_m = ways.lengths_m[left] / 2
    figures = np.zeros((2, boats, rows, rows))
    between = ways.between[:, :, left[:, None], left].mean(axis=(4, 5))
    # Half of each part on the way in and half on the way out: a tour's sum then has every part once.
    figures[:, :, :count, :count] = between + half_m[:, None] + half_m
    starts, recoveries = (of[:, :, left].mean(axis=3) + half_m for of in (ways.starts, ways.recoveries))
    # No vehicle passes another one's start or recovery: those entries only fill the matrix.
    access = np.concatenate([starts, recoveries], axis=1)
    figures[:, :, count:, :count] = access[:, None]
    figures[:, :, :count, count:] = access[:, None].swapaxes(2, 3)
    figures[:, :, np.arange(rows), np.arange(rows)] = 0.0
    return Problem(
        vehicles=fleet.cautious_slaves,
        distances=figures[LENGTH],
        costs=figures[COST],
        objective=Objective.MAKESPAN,
        values=np.array([parts[number].value for number in left.tolist()], dtype=float),
    )


def _journey(slave: int, tour: Indices, parts: Sequence[Part], fleet: Fleet, ways: FleetWays) -> Journey:
    """The path of one tour with its parts in the best orientation, checked."""
    turns = _turns(slave, tour, ways, fleet.slaves[slave].length_m)
    numbers = tour.tolist()
    lines = [
        parts[number].line.reverse() if turn else parts[number].line
        for number, turn in zip(numbers, turns, strict=True)
    ]
    stops = [fleet.out[slave], *lines, fleet.home[slave]]
    enters = [2 * number + turn for number, turn in zip(numbers, turns, strict=True)]
    routes = [
        ways.out(slave, enters[0]),
        # A vehicle that enters a line at one end leaves it at the other: `^ 1` is the other end.
        *(ways.route(slave, before ^ 1, after) for before, after in pairwise(enters)),
        ways.home(slave, enters[-1] ^ 1),
    ]
    travelled = [stops[0], *(line for pair in zip(routes, stops[1:], strict=True) for line in pair)]
    path = chained_line(travelled)
    _require_conforming(path, fleet, slave)
    return Journey(slave, tuple(tour.tolist()), path, tuple(routes))


def _turns(slave: int, tour: Indices, ways: FleetWays, range_m: float) -> list[int]:
    """Which parts to travel backwards (1), for the cheapest path within range.

    If the cheapest path is too long, metres count more and more, until at last the shortest path is taken: that
    one is within range.
    """
    for weights in ((1.0, 0.0), (1.0, 1.0), (1.0, 10.0), (0.0, 1.0)):
        turns = _best_turns(slave, tour, ways, np.array(weights))
        if _length_m(slave, tour, turns, ways) <= range_m:
            break
    return turns


def _best_turns(slave: int, tour: Indices, ways: FleetWays, weights: FloatArray) -> list[int]:
    """The turns of least weighted cost and length, by dynamic programming along the tour."""
    starts, recoveries = (np.tensordot(weights, of[:, slave], 1) for of in (ways.starts, ways.recoveries))
    so_far = starts[tour[0]]
    came_from: list[Indices] = []
    for before, after in pairwise(tour):
        # `[::-1]`, since a vehicle that enters at one end leaves at the other.
        longer = so_far[:, None] + np.tensordot(weights, ways.between[:, slave, before, after], 1)[::-1]
        came_from.append(longer.argmin(axis=0))
        so_far = longer.min(axis=0)
    turns = [int((so_far + recoveries[tour[-1]][::-1]).argmin())]
    for best in reversed(came_from):
        turns.append(int(best[turns[-1]]))
    return turns[::-1]


def _length_m(slave: int, tour: Indices, turns: Sequence[int], ways: FleetWays) -> float:
    """Metres of a tour with its parts turned."""
    enters = np.array(turns)
    hops = ways.between[LENGTH, slave, tour[:-1], tour[1:], 1 - enters[:-1], enters[1:]].sum()
    out = ways.starts[LENGTH, slave, tour[0], enters[0]]
    home = ways.recoveries[LENGTH, slave, tour[-1], 1 - enters[-1]]
    return float(out + hops + home + ways.lengths_m[tour].sum())


def _require_conforming(path: LineString, fleet: Fleet, slave: int) -> None:
    """Check that a path is within the slave's range and, except for its legs, inside the free space.

    Raises
    ------
    Internal
        It is not: a fault of the planner, which must not reach a vehicle.
    """
    vehicle = fleet.slaves[slave]
    if path.length > vehicle.length_m:
        raise Internal(f"the sortie is {path.length:.3f} m long, of {vehicle.length_m:.3f} m", vehicle.name)
    allowed = shapely.union_all([fleet.free, fleet.out[slave], fleet.home[slave]])
    stray = path.difference(allowed.buffer(ROUNDING_M))
    if stray.length > ROUNDING_M:
        place = stray.interpolate(0.5, normalized=True)
        raise Internal(
            f"the sortie leaves the free space for {stray.length:.3f} m, near ({place.x:.1f}, {place.y:.1f})",
            vehicle.name,
        )
