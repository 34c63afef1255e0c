"""What a route is, and what every method of finding routes offers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
import numpy.typing as npt
from shapely import LineString

from oxbow.arrays import FloatArray
from oxbow.contracts.route import RouteMethod
from oxbow.geometry.route.danger import Danger
from oxbow.geometry.route.mesh import WaterMesh

__all__ = ["Route", "RouteMethod", "RouteTable", "Router", "measured_route"]


@dataclass(frozen=True)
class Route:
    """A way through the water.

    Parameters
    ----------
    polyline : ndarray, shape (n, 2)
        From start to goal, in metres.
    length_m
        Its length.
    cost
        In metres: the length, plus the cost of the danger on the way (`Danger.costs` over its edges).
    danger
        The probability of harm on the way, 1 - prod(1 - P_k) over its edges.
    clearance_m
        Its least distance from the shore.
    method
        How it was found.
    """

    polyline: FloatArray
    length_m: float
    cost: float
    danger: float
    clearance_m: float
    method: RouteMethod

    @cached_property
    def line(self) -> LineString:
        """The polyline as geometry."""
        return LineString(self.polyline)


@dataclass(frozen=True)
class RouteTable:
    """Routes between all pairs of n places.

    Parameters
    ----------
    costs, lengths_m : ndarray, shape (n, n)
        Of the cheapest routes: in metres, with and without the cost of danger. Symmetric, 0 on the diagonal, inf
        where no water leads from one place to the other.
    polyline
        The route from one place to another, by their numbers, shape (k, 2); `Infeasible` where the cost is inf.
    """

    costs: FloatArray
    lengths_m: FloatArray
    polyline: Callable[[int, int], FloatArray]


class Router(Protocol):
    """Finds routes through one water."""

    def route(self, start: npt.ArrayLike, goal: npt.ArrayLike) -> Route:
        """The cheapest route that the method finds from one place to another.

        Parameters
        ----------
        start, goal : array_like, shape (2,)
            (x, y) in metres.

        Returns
        -------
        Route
            From start to goal exactly as given.

        Raises
        ------
        Infeasible
            Start or goal lies outside the water (`where` says which), or no water leads from one to the other.
        """

    def table(self, points: npt.ArrayLike) -> RouteTable:
        """The routes between all pairs of places, given as an array of shape (n, 2), in metres.

        Raises
        ------
        Infeasible
            A place lies outside the water; `where` is ``points[k]``.
        """

    def distances(self, points: npt.ArrayLike) -> FloatArray:
        """Costs of the routes between all pairs of places, in metres; lengths, where there is no danger.

        Parameters
        ----------
        points : array_like, shape (n, 2)
            In metres.

        Returns
        -------
        ndarray, shape (n, n)
            Symmetric, 0 on the diagonal, inf where no water leads from one place to the other.

        Raises
        ------
        Infeasible
            A place lies outside the water; `where` is ``points[k]``.
        """


def measured_route(polyline: FloatArray, mesh: WaterMesh, danger: Danger, method: RouteMethod) -> Route:
    """The route along a polyline, with its length, cost, danger and clearance.

    Parameters
    ----------
    polyline : ndarray, shape (n, 2)
        In the water, from start to goal, in metres. Of equal neighbours one is kept.
    mesh
        The water.
    danger
        The danger zones, as they count for one vehicle.
    method
        How the polyline was found.

    Returns
    -------
    Route
        Its cost includes the danger of the zones that it starts in.
    """
    polyline = _without_repeats(polyline)
    starts, ends = polyline[:-1], polyline[1:]
    # Edges count entries into zones; one that starts inside a zone does not enter it.
    at_start = danger.hazards_at(polyline[:1]).sum()
    return Route(
        polyline=polyline,
        length_m=float(np.hypot(*(ends - starts).T).sum()),
        cost=float(danger.costs(starts, ends).sum() + danger.hazard_m * at_start),
        danger=danger.probability(polyline),
        clearance_m=mesh.clearance_m(LineString(polyline)),
        method=method,
    )


def _without_repeats(polyline: FloatArray) -> FloatArray:
    """A polyline without equal neighbours; two points at least."""
    repeated = (polyline[1:] == polyline[:-1]).all(axis=1)
    kept = polyline[np.concatenate([[True], ~repeated])]
    return kept if len(kept) > 1 else np.vstack([kept, kept])
