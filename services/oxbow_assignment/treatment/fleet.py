"""The slaves: where each enters and leaves the free space, and how far treatments lie from there.

Where there are danger zones, routes are those of least cost: danger on the way has a price in metres (M.
Innocenti, L. Pollini and A. Bracci 2006, section 3), times the vehicle's danger factor for what it is sent to. A
range limits what is travelled: the lengths of the same routes, without the price. A route that starts in a zone
counts that zone's danger, and so does the route that led there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import shapely
from msgspec import structs
from shapely import LineString, Polygon

from oxbow.arrays import FloatArray, Indices
from oxbow.contracts import Vehicle
from oxbow.errors import Infeasible, InvalidRequest
from oxbow.geometry.route import NO_DANGER, Danger, RouteMethod, Router, RouteTable, leg_routes, way_to
from oxbow.geometry.route.mesh import WaterMesh
from oxbow.geometry.route.methods import router_on
from oxbow_assignment.targets.problem import LENGTH

__all__ = ["Fleet", "FleetWays"]

MARGIN = 1e-9
"""Fraction of each range that is kept back for rounding."""


@dataclass(frozen=True)
class FleetWays:
    """The best routes of v slaves from and to the ends of n lines; figures are cost and length, in metres.

    Parameters
    ----------
    starts, recoveries : ndarray of shape (2, v, n, 2)
        From each slave's start, and to its recovery, to both ends of each line; legs outside the free space
        included.
    between : ndarray of shape (2, v, n, n, 2, 2)
        From one line's ends to another's, for each slave.
    lengths_m : ndarray of shape (n,)
        The lines' own lengths.
    tables
        The routes for each danger factor.
    factors : ndarray of shape (v, p, p)
        The danger factor of each slave between places: 2 n ends of lines, v docks to set out from, v to come home.
    rows : ndarray of int, shape (p,)
        Each place's index in the tables.
    """

    starts: FloatArray
    recoveries: FloatArray
    between: FloatArray
    lengths_m: FloatArray
    tables: Mapping[float, RouteTable]
    factors: FloatArray
    rows: Indices

    @cached_property
    def access_m(self) -> FloatArray:
        """How far each slave travels to each line and home, on average over both directions, shape (v, n)."""
        return np.asarray(self.starts[LENGTH].mean(axis=2) + self.recoveries[LENGTH].mean(axis=2))

    def route(self, slave: int, start: int, goal: int) -> LineString:
        """The route of a slave from one place to another.

        Parameters
        ----------
        slave
            Its index.
        start, goal
            Places, numbered as in `factors`: end 0 and 1 of line k are 2 k and 2 k + 1.

        Returns
        -------
        LineString
            In the free space; its ends are the two places.
        """
        table = self.tables[float(self.factors[slave, start, goal])]
        return LineString(table.polyline(int(self.rows[start]), int(self.rows[goal])))

    def out(self, slave: int, end: int) -> LineString:
        """The route of a slave from where it enters the free space to an end of a line.

        Parameters
        ----------
        slave
            Its index.
        end
            2 k or 2 k + 1, for the first or last point of line k.

        Returns
        -------
        LineString
            Without the leg to the free space.
        """
        return self.route(slave, 2 * len(self.lengths_m) + slave, end)

    def home(self, slave: int, end: int) -> LineString:
        """The route of a slave from an end of a line to where it leaves the free space.

        Parameters
        ----------
        slave, end
            See `out`.

        Returns
        -------
        LineString
            Without the leg from the free space.
        """
        return self.route(slave, end, 2 * len(self.lengths_m) + len(self.factors) + slave)


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
        Danger in the free space, for a vehicle of factor 1.
    method
        How routes through the free space are found.
    out, home
        A leg for each slave: from its start to the free space, and from there to its recovery (`way_to`); of
        length 0 if the point lies in the free space.
    """

    slaves: tuple[Vehicle, ...]
    free: Polygon
    water: Polygon
    danger: Danger
    method: RouteMethod
    out: tuple[LineString, ...]
    home: tuple[LineString, ...]

    @classmethod
    def of(
        cls,
        slaves: Sequence[Vehicle],
        free: Polygon,
        water: Polygon,
        danger: Danger = NO_DANGER,
        method: RouteMethod = RouteMethod.VISIBILITY,
    ) -> Fleet:
        """The slaves and their legs.

        Parameters
        ----------
        slaves
            At least one.
        free
            Where they may go; prepared.
        water
            What their legs may cross.
        danger
            What routes through the free space avoid.
        method
            How they are found.

        Returns
        -------
        Fleet
            With its legs; routes are searched for when they are asked for.

        Raises
        ------
        InvalidRequest
            There is no slave.
        Infeasible
            A slave's range is too short to reach the free space and go home.
        """
        if not slaves:
            raise InvalidRequest("has no slave; expected one or more to treat the hot spots", where="vehicles")
        shore = leg_routes(free, water)
        out = tuple(LineString(way_to(free, shore, slave.start, where=slave.field("start"))) for slave in slaves)
        home = tuple(
            LineString(way_to(free, shore, slave.recovery, where=slave.field("recovery"))[::-1])
            for slave in slaves
        )
        for slave, leg, back in zip(slaves, out, home, strict=True):
            if leg.length + back.length >= slave.length_m:
                raise Infeasible(
                    f"lies {leg.length:.0f} m outside the free space, and the recovery {back.length:.0f} m;"
                    f" expected less than the vehicle's {slave.length_m:.0f} m in all",
                    where=slave.field("start"),
                )
        return cls(tuple(slaves), free, water, danger, method, out, home)

    @cached_property
    def cautious_slaves(self) -> tuple[Vehicle, ...]:
        """The slaves with a little less range, so that what is planned for these fits in spite of rounding."""
        return tuple(structs.replace(slave, length_m=slave.length_m * (1.0 - MARGIN)) for slave in self.slaves)

    @cached_property
    def lengths_m(self) -> FloatArray:
        """The range that a single part may use of each slave, in metres, shape (v,): again a little less."""
        return np.array([slave.length_m * (1.0 - MARGIN) for slave in self.cautious_slaves])

    @property
    def finds_shortest(self) -> bool:
        """Whether routes are the shortest there are, so that no detour over a third place is shorter."""
        return self.method is RouteMethod.VISIBILITY and not self.danger.outlines

    @cached_property
    def _legs_m(self) -> FloatArray:
        """Length of each leg out, then of each leg home, shape (2 v,)."""
        return shapely.length(np.array([*self.out, *self.home]))

    def ways(self, lines: Sequence[LineString], spots: Sequence[str] = ()) -> FleetWays:
        """The best routes between the ends of some lines, and from and to the slaves.

        Parameters
        ----------
        lines
            What is treated; at least one.
        spots
            The name of each line's hot spot, for slaves with a danger factor for it; empty for no names.

        Returns
        -------
        FleetWays
            Infinite where no route leads.
        """
        # 1. All places that ways begin or end at.
        ends = np.array([line.coords[end] for line in lines for end in (0, -1)])
        docks = np.array([leg.coords[-1] for leg in self.out] + [leg.coords[0] for leg in self.home])
        # Slaves often share their docks: each distinct place is searched from once.
        places, rows = np.unique(np.vstack([ends, docks]), axis=0, return_inverse=True)
        # 2. One table of routes per danger factor: the cost of danger, and with it the route, depends on who
        # travels.
        factors = self._factors(spots or [""] * len(lines))
        tables = {factor: self._router(factor).table(places) for factor in np.unique(factors).tolist()}
        figures = np.empty((2, *factors.shape))
        for factor, table in tables.items():
            for own, known in zip(figures, (table.costs, table.lengths_m), strict=True):
                known_there = np.broadcast_to(known[np.ix_(rows, rows)], factors.shape)
                own[factors == factor] = known_there[factors == factor]
        # 3. From the tables' rows to figures by boat, line and end; the legs to and from the docks are added on
        # top.
        count, boats = len(lines), len(self.slaves)
        each = np.arange(boats)
        docked = [figures[:, each, 2 * count + k * boats + each, : 2 * count] for k in (0, 1)]
        from_docks = np.stack(docked, axis=1)
        from_docks = (from_docks + self._legs_m.reshape(2, boats, 1)).reshape(2, 2, boats, count, 2)
        between = figures[:, :, : 2 * count, : 2 * count].reshape(2, boats, count, 2, count, 2)
        return FleetWays(
            starts=from_docks[:, 0],
            recoveries=from_docks[:, 1],
            between=between.transpose(0, 1, 2, 4, 3, 5),
            lengths_m=shapely.length(np.asarray(lines)),
            tables=tables,
            factors=factors,
            rows=rows,
        )

    def _factors(self, spots: Sequence[str]) -> FloatArray:
        """The danger factor of each slave between places, shape (v, p, p); see `Ways.factors`.

        A route takes the factors of its ends: between two hot spots, the greater one.
        """
        count = 2 * len(spots) + 2 * len(self.slaves)
        if not self.danger.outlines:
            return np.ones((len(self.slaves), count, count))
        own = np.ones((len(self.slaves), count))
        for row, slave in zip(own, self.slaves, strict=True):
            known = [slave.danger_factors.get(spot, slave.danger_factor) for spot in spots]
            row[: 2 * len(spots)] = np.repeat(known, 2)
        return np.maximum(own[:, :, None], own[:, None, :])

    @cached_property
    def _mesh(self) -> WaterMesh:
        return WaterMesh.of(self.free, self.danger.outlines)

    @cached_property
    def _routers(self) -> dict[float, Router]:
        """The routers that have been needed so far, by danger factor."""
        return {}

    def _router(self, factor: float) -> Router:
        if factor not in self._routers:
            danger = replace(self.danger, a=factor)
            self._routers[factor] = router_on(self._mesh, self.method, danger)
        return self._routers[factor]
