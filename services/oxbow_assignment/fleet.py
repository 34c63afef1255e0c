"""The slaves at sea: where each enters and leaves the free space, and how far treatments lie from there.

Where there are danger zones, metres are costs: what danger on the way is worth counts as so many metres, against a
range too (M. Innocenti, L. Pollini and A. Bracci 2006, section 3). Costs are never less than lengths, whichever of
several equally cheap routes is taken, so that a sortie within its costs is within its range. A route that starts
in a zone counts it, and so does the route that led there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import shapely
from msgspec import structs
from shapely import LineString, Polygon

from oxbow.contracts import FloatArray, Vehicle
from oxbow.errors import Infeasible, InvalidMission
from oxbow.route import NO_DANGER, Danger, RouteMethod, Router, Routes, make_router, way_to

__all__ = ["Fleet", "Ways"]

MARGIN = 1e-9
"""Share of each range that is kept back for rounding."""


@dataclass(frozen=True)
class Ways:
    """Metres along the best routes from and to the ends of n lines.

    Parameters
    ----------
    starts, recoveries : ndarray of shape (v, n, 2)
        From each slave's start, and to its recovery, over its leg ashore if it has one, to both ends of each line.
    between : ndarray of shape (n, n, 2, 2)
        From one line's ends to another's.
    lengths_m : ndarray of shape (n,)
        The lines' own lengths.
    """

    starts: FloatArray
    recoveries: FloatArray
    between: FloatArray
    lengths_m: FloatArray

    @cached_property
    def access_m(self) -> FloatArray:
        """What it takes each slave to get to each line and home, either way round on average, shape (v, n)."""
        return np.asarray(self.starts.mean(axis=2) + self.recoveries.mean(axis=2))


@dataclass(frozen=True)
class Fleet:
    """Slaves, and where they enter and leave the free space.

    Parameters
    ----------
    slaves
        At least one.
    free
        Where they may go; prepared.
    water
        What their legs may cross.
    danger
        What is to be avoided there.
    routers
        Each slave's own, with its `a`, for its ways from its start and to its recovery.
    router
        Of the ways between treatments, with an `a` of 1: the report sets it between vehicles and targets alone.
    out, home
        A leg for each slave: from its start to the free space, and from there to its recovery (`way_to`); of no
        length where the point lies in the free space.
    """

    slaves: tuple[Vehicle, ...]
    free: Polygon
    water: Polygon
    danger: Danger
    routers: tuple[Router, ...]
    router: Router
    out: tuple[LineString, ...]
    home: tuple[LineString, ...]

    @classmethod
    def of(cls, slaves: Sequence[Vehicle], free: Polygon, water: Polygon, danger: Danger = NO_DANGER) -> Fleet:
        """The slaves, their legs and their routers.

        Raises
        ------
        InvalidMission
            There is no slave.
        Infeasible
            A slave's range does not suffice to reach the free space and go home.
        """
        if not slaves:
            raise InvalidMission("has no slave; expected one or more to treat the hot spots", where="vehicles")
        shore = Routes(water)
        out = tuple(LineString(way_to(free, shore, slave.start)) for slave in slaves)
        home = tuple(LineString(way_to(free, shore, slave.recovery)[::-1]) for slave in slaves)
        for slave, leg, back in zip(slaves, out, home, strict=True):
            if leg.length + back.length >= slave.length_m:
                raise Infeasible(
                    f"lies {leg.length:.0f} m outside the free space, and the recovery {back.length:.0f} m;"
                    f" expected less than the vehicle's {slave.length_m:.0f} m in all",
                    where=f"vehicle {slave.name!r}: start",
                )
        factors = [slave.danger_factor if danger.zones else 1.0 for slave in slaves]
        routers = {
            factor: make_router(RouteMethod.VISIBILITY, free, replace(danger, a=factor))
            for factor in {1.0, *factors}
        }
        own = tuple(routers[factor] for factor in factors)
        return cls(tuple(slaves), free, water, danger, own, routers[1.0], out, home)

    @cached_property
    def cautious_slaves(self) -> tuple[Vehicle, ...]:
        """The slaves, with a little less range."""
        return tuple(structs.replace(slave, length_m=slave.length_m * (1.0 - MARGIN)) for slave in self.slaves)

    @cached_property
    def lengths_m(self) -> FloatArray:
        """What a single part may ask of each slave, shape (v,): again a little less."""
        return np.array([slave.length_m * (1.0 - MARGIN) for slave in self.cautious_slaves])

    @cached_property
    def _legs_m(self) -> FloatArray:
        """Length of each leg out, then of each leg home, shape (2 v,)."""
        return shapely.length(np.array([*self.out, *self.home]))

    def ways(self, lines: Sequence[LineString]) -> Ways:
        """How far the ends of some lines lie from the slaves and from one another."""
        ends = np.array([line.coords[end] for line in lines for end in (0, -1)])
        docks = np.array([leg.coords[-1] for leg in self.out] + [leg.coords[0] for leg in self.home])
        places, row = np.unique(np.vstack([ends, docks]), axis=0, return_inverse=True)
        metres = {router: router.distances(places)[np.ix_(row, row)] for router in {self.router, *self.routers}}
        count, boats = len(lines), len(self.slaves)
        from_docks = np.array(
            [metres[router][2 * count + k, : 2 * count] for k, router in enumerate(2 * self.routers)]
        )
        from_docks = (from_docks + self._legs_m[:, None]).reshape(2, boats, count, 2)
        between = metres[self.router][: 2 * count, : 2 * count].reshape(count, 2, count, 2).transpose(0, 2, 1, 3)
        return Ways(from_docks[0], from_docks[1], between, shapely.length(np.asarray(lines)))
