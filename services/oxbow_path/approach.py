"""A path in a share, and the legs that join it to the vehicle's own places.

A share is planned as a lake of its own. A vehicle whose start lies elsewhere enters it at a *gate* and leaves it
there (`oxbow.contracts.Approach`): its legs keep to the free space, and, like ships, to one side, so that the way
home runs beside the way out and the whole path stays simple.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from msgspec import structs
from shapely import LineString, MultiPolygon
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring

from oxbow.arrays import FloatArray
from oxbow.contracts import Approach, PathPlan, PathRequest
from oxbow.contracts.budget import WELL_USED
from oxbow.errors import Infeasible
from oxbow.geometry.conformance import SHORE_TOLERANCE_M
from oxbow.geometry.lanes import lane

__all__ = ["plan_with_legs", "within_share"]

HALVINGS = 8
"""How often the distance of legs from their middle lines may be halved until both fit."""


def within_share(request: PathRequest, approach: Approach) -> PathRequest:
    """The request for the path in a share alone.

    Parameters
    ----------
    request
        What is asked, from the vehicle's start to its recovery.
    approach
        The legs to the share.

    Returns
    -------
    PathRequest
        From gate to gate, with the length that the legs leave.
    """
    space = request.space
    if approach.out is not None and approach.home is not None:
        # All of the path lies in the share: it is the gate that legs lead to.
        space = structs.replace(space, water=space.free)
    return structs.replace(
        request,
        space=space,
        launch=approach.launch,
        recovery=approach.recovery,
        length_m=request.length_m - approach.legs_m,
        approach=None,
    )


def plan_with_legs(plan: PathPlan, request: PathRequest, approach: Approach) -> PathPlan:
    """The plan of a share with its legs: from the vehicle's start to its recovery.

    Parameters
    ----------
    plan
        The plan of `within_share`.
    request
        What is asked, with the vehicle's whole length.
    approach
        The legs to the share.

    Returns
    -------
    PathPlan
        The same but for its path, and a warning where the legs leave much of the length unused.

    Raises
    ------
    Infeasible
        The water is too narrow for both legs.
    """
    path = path_with_approach(plan.path, approach)
    in_share = plan.path.length / (request.length_m - approach.legs_m)
    of_all = path.length / request.length_m
    # The stage itself says why the path in the share leaves length; here, what was kept for the legs is left.
    unused = of_all < WELL_USED <= in_share
    text = f"uses {of_all:.1%} of its longest length: its legs are shorter than what was kept for them"
    return structs.replace(plan, path=path, warnings=(*plan.warnings, text) if unused else plan.warnings)


def path_with_approach(path: LineString, approach: Approach) -> LineString:
    """A path in a share with its legs; see `plan_with_legs`.

    Parameters
    ----------
    path
        From gate to gate.
    approach
        The legs to the share.

    Returns
    -------
    LineString
        Simple; its legs keep to the approach's water.
    """
    # To the tolerance of the rules: a lane along the shore is off it by rounding.
    water = MultiPolygon(approach.water).buffer(SHORE_TOLERANCE_M)
    for candidate in _candidates(shapely.get_coordinates(path), approach):
        line = candidate.line
        if line.is_simple and all(leg.difference(water).length == 0.0 for leg in candidate.legs):
            return line
    raise Infeasible("can be reached only through water too narrow for a way back beside the way out", "launch")


@dataclass(frozen=True)
class _Candidate:
    """A path in a share, and its legs where it has them."""

    out: FloatArray | None
    way: FloatArray
    home: FloatArray | None

    @property
    def line(self) -> LineString:
        return LineString(np.vstack([part for part in (self.out, self.way, self.home) if part is not None]))

    @property
    def legs(self) -> list[BaseGeometry]:
        """Each with the step from or to the path."""
        legs = [] if self.out is None else [np.vstack([self.out, self.way[:1]])]
        legs += [] if self.home is None else [np.vstack([self.way[-1:], self.home])]
        return [LineString(leg) for leg in legs]


def _candidates(path: FloatArray, approach: Approach) -> Iterator[_Candidate]:
    """Legs on either side, with the path either way round, ever nearer to each other."""
    out, home = approach.out, approach.home
    if out is None or home is None:
        first = None if out is None else shapely.get_coordinates(out.line)
        last = None if home is None else shapely.get_coordinates(home.line)[::-1]
        yield _Candidate(first, path, last)
        return
    if approach.launch != approach.recovery:
        # Two gates: the middle lines themselves may be clear of each other.
        yield _Candidate(shapely.get_coordinates(out.line), path, shapely.get_coordinates(home.line)[::-1])
    line = LineString(path)
    # From wide to narrow: the first that fits is taken, and legs far apart are the easiest to follow.
    for apart_m in approach.apart_m * 0.5 ** np.arange(HALVINGS):
        for side, way in itertools.product((1.0, -1.0), _ways_round(line, approach, apart_m)):
            yield _Candidate(lane(out, side * apart_m), way, lane(home, -side * apart_m)[::-1])


def _ways_round(line: LineString, approach: Approach, apart_m: float) -> list[FloatArray]:
    """The path between the gates; either way round, and open by the width of both legs, where they are one."""
    if approach.launch != approach.recovery:
        return [shapely.get_coordinates(line)]
    inner = shapely.get_coordinates(substring(line, 2.0 * apart_m, line.length - 2.0 * apart_m))
    return [inner, inner[::-1]]
