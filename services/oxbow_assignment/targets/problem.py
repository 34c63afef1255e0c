"""The problem of assignment: targets, vehicles, and the routes between them.

Routes have two figures: their cost, danger included, and their length. An assignment minimises costs; lengths must
be within a range.
"""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from oxbow.arrays import FloatArray, Indices, Mask
from oxbow.contracts import Role, Vehicle
from oxbow.errors import InvalidRequest

__all__ = ["COST", "LENGTH", "SUM_ROUNDING", "Objective", "Problem", "require_distances"]

COST, LENGTH = 0, 1
"""The two figures of a route: the first index of arrays that have both."""


SUM_ROUNDING = 1e-12
"""Sums of the same lengths in another order differ by less than this fraction."""

SYMMETRY = 1e-6
"""Relative differences between there and back of no more than this are rounding."""

MAKESPAN_POWER = 8
"""The sum of this power of durations is a smooth stand-in for the longest."""


class Objective(enum.StrEnum):
    """What an assignment minimises, once as much value as possible is served.

    `TOTAL` is the sum of all vehicles' durations: the team cost J of Innocenti, Pollini and Bracci 2006,
    section 4.2. It may leave vehicles at home. `MAKESPAN` is the longest duration: when the last vehicle is
    done. Durations are those of costs: the price of danger, in metres, counts as metres travelled.
    """

    TOTAL = "total"
    MAKESPAN = "makespan"


@dataclass(frozen=True)
class Problem:
    """Targets to be visited by vehicles.

    Parameters
    ----------
    vehicles
        At least one; no two have the same name.
    distances : ndarray of shape (n + 2 v, n + 2 v), or (v, n + 2 v, n + 2 v)
        Metres along the routes between the n targets, then the v vehicles' starts, then their recoveries, as
        `RouteTable` gives for these points in this order, for all vehicles or for each. Symmetric; infinite where
        there is no route.
    objective
        What to minimise.
    values : ndarray of shape (n,)
        The value of visiting each target; > 0, by default 1. If not all can be visited, value comes first.
    roles
        For each target the role that a vehicle needs to visit it, or None for any; by default None for all.
    costs : ndarray of shape (n + 2 v, n + 2 v), or (v, n + 2 v, n + 2 v)
        Costs of the same routes, in metres; by default their lengths.

    Raises
    ------
    InvalidRequest
        A field breaks these rules.
    """

    vehicles: tuple[Vehicle, ...]
    distances: FloatArray
    objective: Objective = Objective.TOTAL
    values: FloatArray = field(default_factory=lambda: np.empty(0))
    roles: tuple[Role | None, ...] = ()
    costs: FloatArray | None = None

    def __post_init__(self) -> None:
        _require_vehicles(self.vehicles)
        for own in self.distances.reshape(-1, *self.distances.shape[-2:]):
            require_distances(own)
        if self.distances.shape[-1] < 2 * len(self.vehicles):
            raise InvalidRequest(
                f"has {self.distances.shape[-1]} rows; expected at least {2 * len(self.vehicles)}:"
                f" a start and a recovery for each of {len(self.vehicles)} vehicles",
                where="distances",
            )
        if not len(self.values):
            object.__setattr__(self, "values", np.ones(self.count))
        if self.values.shape != (self.count,) or not (np.isfinite(self.values) & (self.values > 0)).all():
            raise InvalidRequest(f"expected {self.count} finite numbers > 0, one per target", where="values")
        if len(self.roles) not in (0, self.count):
            raise InvalidRequest(f"has {len(self.roles)}; expected {self.count}, one per target", where="roles")

    @property
    def count(self) -> int:
        """How many targets there are."""
        return int(self.distances.shape[-1]) - 2 * len(self.vehicles)

    def path(self, vehicle: int, targets: Sequence[int] | Indices) -> Indices:
        """The rows that a vehicle passes: its start, its targets and its recovery.

        Parameters
        ----------
        vehicle
            Its index.
        targets
            Indices of targets, in order.

        Returns
        -------
        ndarray of int, shape (k + 2,)
            Rows of the problem's distances.
        """
        return np.array([self.starts[vehicle], *targets, self.recoveries[vehicle]])

    @property
    def targets(self) -> slice:
        """The targets' rows."""
        return slice(0, self.count)

    @property
    def starts(self) -> Indices:
        """The row of each vehicle's start."""
        return self.count + np.arange(len(self.vehicles))

    @property
    def recoveries(self) -> Indices:
        """The row of each vehicle's recovery."""
        return self.count + len(self.vehicles) + np.arange(len(self.vehicles))

    @cached_property
    def lengths_m(self) -> FloatArray:
        """Each vehicle's range, in metres, shape (v,)."""
        return np.array([vehicle.length_m for vehicle in self.vehicles])

    @cached_property
    def speeds_mps(self) -> FloatArray:
        """Each vehicle's speed, shape (v,)."""
        return np.array([vehicle.speed_mps for vehicle in self.vehicles])

    def strain(self, costs_m: FloatArray, vehicles: Indices) -> FloatArray:
        """What tours of these costs add to the objective, shape (k,).

        The longest duration alone cannot tell good moves between other tours from bad ones. For `MAKESPAN` the
        strain is therefore a high power of the duration: the longest ones dominate the sum.

        Parameters
        ----------
        costs_m
            The costs of tours, in metres, shape (k,).
        vehicles
            The vehicle of each tour, shape (k,).

        Returns
        -------
        ndarray of shape (k,)
            Seconds for `TOTAL`, their power for `MAKESPAN`.
        """
        durations: FloatArray = costs_m / self.speeds_mps[vehicles]
        return durations**MAKESPAN_POWER if self.objective is Objective.MAKESPAN else durations

    @cached_property
    def lengths(self) -> FloatArray:
        """Lengths of routes for each vehicle, infinite where there is none, shape (v, n + 2 v, n + 2 v)."""
        rows = self.distances.shape[-1]
        return np.broadcast_to(self.distances, (len(self.vehicles), rows, rows))

    @cached_property
    def figures(self) -> FloatArray:
        """Costs and lengths of routes for each vehicle, shape (2, v, n + 2 v, n + 2 v).

        Where there is no route, both are beyond every range.
        """
        costs = self.distances if self.costs is None else self.costs
        both = np.stack([np.broadcast_to(costs, self.lengths.shape), self.lengths])
        # Finite, since infinity minus infinity in a gain would be NaN, and compare as false everywhere.
        far_m = 2.0 * max(float(both[np.isfinite(both)].max()), float(self.lengths_m.max()))
        return np.where(np.isfinite(both), both, far_m)

    @cached_property
    def mean_costs(self) -> FloatArray:
        """Costs of routes, averaged over the vehicles, in metres, shape (n + 2 v, n + 2 v)."""
        return np.asarray(self.figures[COST].mean(axis=0))

    @cached_property
    def there_and_back_m(self) -> FloatArray:
        """The length of each vehicle's tour of one target alone, in metres, shape (v, n)."""
        each = np.arange(len(self.vehicles))
        ends = self.lengths[each, self.starts] + self.lengths[each, self.recoveries]
        return np.asarray(ends[:, self.targets])

    def is_within_range(self, vehicle: int, path: Indices) -> bool:
        """Whether a vehicle's path is within its range; one without targets always is.

        Parameters
        ----------
        vehicle
            Its index.
        path
            Rows of the distances, start first and recovery last.

        Returns
        -------
        bool
            Exactly, without an allowance for rounding.
        """
        length_m = float(self.figures[LENGTH, vehicle, path[:-1], path[1:]].sum())
        return len(path) <= 2 or length_m <= self.lengths_m[vehicle]

    @cached_property
    def has_role(self) -> Mask:
        """Which vehicle has the role that each target asks for, shape (v, n)."""
        roles = self.roles or (None,) * self.count
        allowed = [[role in (None, vehicle.role) for role in roles] for vehicle in self.vehicles]
        return np.array(allowed, dtype=bool).reshape(len(self.vehicles), self.count)

    @cached_property
    def can_visit(self) -> Mask:
        """Which vehicle has the role and the range for each target, shape (v, n)."""
        return self.has_role & (self.there_and_back_m <= self.lengths_m[:, None])


def _require_vehicles(vehicles: Sequence[Vehicle]) -> None:
    """Check that there are vehicles, and that no two have the same name.

    Raises
    ------
    InvalidRequest
        There are none, or two have the same name.
    """
    if not vehicles:
        raise InvalidRequest("is empty; expected at least one vehicle", where="vehicles")
    names = [vehicle.name for vehicle in vehicles]
    for name in names:
        if names.count(name) > 1:
            raise InvalidRequest(
                f"{names.count(name)} vehicles are named {name!r}; expected one", where="vehicles"
            )


def require_distances(distances: FloatArray) -> None:
    """Check a matrix of distances: square, symmetric, no NaN, none negative, zero from a point to itself.

    Raises
    ------
    InvalidRequest
        Names the first entry that is wrong, and what would be accepted.
    """
    if distances.ndim != 2 or distances.shape[0] != distances.shape[1]:
        raise InvalidRequest(f"has shape {distances.shape}; expected a square matrix", where="distances")
    bad = ~(distances >= 0.0)  # not `< 0.0`, which lets NaN pass
    bad[np.diag_indices(len(distances))] |= np.diag(distances) != 0.0
    # Infinite both ways is symmetric, but inf - inf is NaN: -1 stands for it, which no distance is.
    there, back = (
        np.where(np.isinf(distances), -1.0, distances),
        np.where(np.isinf(distances.T), -1.0, distances.T),
    )
    for wrong, expected in (
        (bad, "a number >= 0, and 0 from a point to itself"),
        (np.abs(there - back) > SYMMETRY * (1.0 + there), "the same there and back"),
    ):
        if wrong.any():
            i, j = np.argwhere(wrong)[0].tolist()
            raise InvalidRequest(
                f"is {distances[i, j]:g} m and back {distances[j, i]:g} m; expected {expected}",
                where=f"distances[{i}, {j}]",
            )
