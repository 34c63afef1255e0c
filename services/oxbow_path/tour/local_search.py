"""The project's own solver: 2-opt and Or-opt, and kicks out of what they end in.

2-opt (Croes 1958) replaces two legs, Or-opt (Or 1976) moves up to three sites elsewhere, turned round or not.
Both look at near sites alone, and only where something has changed (neighbour lists and don't-look bits: Bentley
1992). A kick is a double bridge over three legs near one another (Martin, Otto and Felten 1991; by random walks:
Applegate, Cook and Rohe 2003). What a kick and the repair after it make longer is undone.
"""

from __future__ import annotations

import itertools
import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from oxbow.arrays import Indices
from oxbow_path.tour.solver import TourSolution
from oxbow_path.tour.start import Start

__all__ = ["shortened_tour"]

NEIGHBOURS = 8
"""How many of the nearest sites a move may join a site to."""

SEGMENT = 3
"""Or-opt moves at most this many sites."""

KICKS = 5
"""Kicks per site."""

MOST_KICKS = 10_000

ROUND = 1000
"""How many kicks are tried before their gain decides on more."""

LEAST_ROUND = 5e-4
"""A round of kicks that shortens a tour by a smaller part is the last."""

WALK = 3
"""Steps from near site to near site between a kick's first leg and either other."""

LEAST_SITES = 8
"""Fewer sites are not kicked."""

LEAST_GAIN = 1e-9
"""In mean legs: less is rounding."""

Step = Callable[[int], int]


def shortened_tour(start: Start, *, seed: int) -> TourSolution:
    """Shorten a tour: a `Solver`.

    Parameters
    ----------
    start
        A tour, and the distances of near sites.
    seed
        Of the kicks.

    Returns
    -------
    Solution
        No longer than the start.
    """
    search = _Search(start)
    search.descend(start.order.tolist())
    count = len(start.order)
    if count >= LEAST_SITES:
        rng = np.random.default_rng(seed)
        # All random numbers at once, so that the same seed gives the same kicks whatever the search does with
        # them.
        kicks = rng.random((min(KICKS * count, MOST_KICKS), 1 + 2 * WALK))
        for first in range(0, len(kicks), ROUND):
            gained_m = sum(search.kick(chances) for chances in kicks[first : first + ROUND].tolist())
            if gained_m < LEAST_ROUND * start.length_m(search.order):
                break
    return TourSolution(search.order, "2-opt and Or-opt")


@dataclass(frozen=True)
class _Move:
    """Metres gained, and the sites whose legs changed."""

    gain_m: float
    sites: tuple[int, ...]


class _Search:
    """A tour as an array of sites, and the place of every site in it."""

    def __init__(self, start: Start) -> None:
        self.order = np.array(start.order, dtype=np.int64)
        self._count = len(self.order)
        self._place = np.argsort(self.order)
        self._circle = np.arange(2 * self._count) % self._count
        # Views give single numbers several times as fast as arrays do.
        self._site, self._at = self.order.data, self._place.data
        self._to = [dict(row) for row in _rows(start.distances)]
        self._near = [sorted(to, key=to.__getitem__)[:NEIGHBOURS] for to in self._to]
        self._least_gain_m = LEAST_GAIN * start.length_m(self.order) / self._count

    def descend(self, sites: Iterable[int]) -> float:
        """Improve the tour at some sites, and wherever that changes it, until nothing does; the metres gained."""
        queue = deque(sites)
        waiting = set(queue)
        gained_m = 0.0
        while queue:
            site = queue.popleft()
            waiting.discard(site)
            move = self._improvement(site)
            if move is not None:
                gained_m += move.gain_m
                fresh = [end for end in move.sites if end not in waiting]
                queue.extend(fresh)
                waiting.update(fresh)
        return gained_m

    def kick(self, chances: Sequence[float]) -> float:
        """A double bridge at three legs that random walks choose, undone if it makes the tour longer; the gain."""
        first = int(chances[0] * self._count)
        walks = (self._walk(first, chances[1 : 1 + WALK]), self._walk(first, chances[1 + WALK :]))
        i, j, k = sorted(self._at[site] for site in (first, *walks))
        ends = [self._site[(at + step) % self._count] for at in (i, j, k) for step in (0, 1)]
        a, a1, b, b1, c, c1 = ends
        to = self._to
        # Only legs between near sites have a known length.
        if j in (i, k) or not (b1 in to[a] and c1 in to[b] and a1 in to[c]):
            return 0.0
        before = self.order.copy()
        gained_m = to[a][a1] + to[b][b1] + to[c][c1] - to[a][b1] - to[b][c1] - to[c][a1]
        self._exchange(i + 1, j + 1, k + 1)
        gained_m += self.descend(ends)
        if gained_m >= 0.0:
            return gained_m
        # In place: views of the array are held for speed.
        self.order[:] = before
        self._place[before] = np.arange(self._count)
        return 0.0

    def _walk(self, site: int, chances: Sequence[float]) -> int:
        for chance in chances:
            near = self._near[site]
            site = near[int(chance * len(near))]
        return site

    def _after(self, site: int) -> int:
        return self._site[(self._at[site] + 1) % self._count]

    def _before(self, site: int) -> int:
        return self._site[self._at[site] - 1]

    def _improvement(self, a: int) -> _Move | None:
        """The first move found that replaces a leg at `a` by a shorter one, already made."""
        for onward, back in ((self._after, self._before), (self._before, self._after)):
            b = onward(a)
            leg_m = self._to[a][b]
            for c in self._near[a]:
                # The near sites come in order of distance: once the new leg alone is no shorter than the old,
                # none further can be.
                gain_m = leg_m - self._to[a][c]
                if gain_m <= self._least_gain_m:
                    break
                move = self._two_opt(a, b, c, gain_m, onward) or self._or_opt(a, b, c, gain_m, back)
                if move is not None:
                    return move
        return None

    def _two_opt(self, a: int, b: int, c: int, gain_m: float, onward: Step) -> _Move | None:
        """Replace the legs a-b and c-d by a-c and b-d."""
        d = onward(c)
        gain_m += self._to[c][d] - self._to[b].get(d, math.inf)
        if gain_m <= self._least_gain_m:
            return None
        first, last = (b, c) if onward == self._after else (c, b)
        # Turning the stretch from b to c round joins a to c and b to d.
        self._reverse(self._at[first], self._at[last])
        return _Move(gain_m, (a, b, c, d))

    def _or_opt(self, a: int, b: int, c: int, gain_m: float, back: Step) -> _Move | None:
        """Move the sites from a back to some e from between b and q to between c and f, a beside c."""
        segment: list[int] = []
        e = a
        while len(segment) < min(SEGMENT, self._count - 3):
            segment.append(e)
            q = back(e)
            if c in segment:
                break
            freed_m = gain_m + self._to[e][q] - self._to[q].get(b, math.inf)
            for f in (self._after(c), self._before(c)):
                total_m = freed_m + self._to[c][f] - self._to[e].get(f, math.inf)
                if f not in segment and total_m > self._least_gain_m:
                    self._insert(a, e, c, f)
                    return _Move(total_m, (a, b, c, e, f, q))
            e = q
        return None

    def _insert(self, a: int, e: int, c: int, f: int) -> None:
        """Move the segment with ends a and e to between the neighbours c and f, a beside c."""
        place, n = self._at, self._count
        first, last = (e, a) if (place[a] - place[e]) % n < SEGMENT else (a, e)
        x = c if self._after(c) == f else f
        start, end = place[first], place[last]
        if (x == c) != (first == a):
            self._reverse(start, end)
        middle = start + (end - start) % n + 1
        self._exchange(start, middle, middle + (place[x] - middle) % n + 1)

    def _reverse(self, start: int, end: int) -> None:
        """Turn the stretch between two places round, or else the rest: that is the same tour."""
        count = (end - start) % self._count + 1
        # At most half the tour is rewritten per move.
        if 2 * count > self._count:
            start, count = end + 1, self._count - count
        where = self._circle[start % self._count :][:count]
        self._write(where, self.order[where[::-1]])

    def _exchange(self, i: int, j: int, k: int) -> None:
        """Exchange the stretches [i, j) and [j, k), or one of them and the rest: the longest of all stays."""
        n = self._count
        lengths = (j - i, k - j, n + i - k)
        start, one, other = ((j, 1, 2), (k, 2, 0), (i, 0, 1))[max(range(3), key=lengths.__getitem__)]
        where = self._circle[start % n :][: lengths[one] + lengths[other]]
        sites = self.order[where]
        self._write(where, np.concatenate([sites[lengths[one] :], sites[: lengths[one]]]))

    def _write(self, where: Indices, sites: Indices) -> None:
        self.order[where] = sites
        self._place[sites] = where


def _rows(distances: csr_array[np.float64]) -> Iterator[Iterator[tuple[int, float]]]:
    """For each site, the others near it and their distances."""
    columns, lengths = distances.indices.tolist(), distances.data.tolist()
    for start, end in itertools.pairwise(distances.indptr.tolist()):
        yield zip(columns[start:end], lengths[start:end], strict=True)
