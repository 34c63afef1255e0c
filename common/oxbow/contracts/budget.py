"""How a vehicle's length is spent: the spacing of legs, the reserve, and the refusal of a length too short."""

from __future__ import annotations

import math

from oxbow.errors import Infeasible

__all__ = ["LENGTH_RESERVE", "nominal_spacing_m", "too_short"]

LEAST_SPACINGS = 8
"""A path is at least this many spacings long: a short one misses much of a large water, wherever it runs."""


def nominal_spacing_m(area_m2: float, length_m: float, least_m: float = 0.0) -> float:
    """Area / length (Rendas and Li 2016, section 1.2.1.1, step 5), in metres, but no less than the least accepted.

    Where a length is far too short for the water, the spacing follows from the length alone: at area / length the
    path would have no legs.

    Parameters
    ----------
    area_m2
        Of the water to cover.
    length_m
        What a vehicle may travel; positive.
    least_m
        The least spacing that is accepted.

    Returns
    -------
    float
        In metres, greater than 0.
    """
    return max(min(area_m2 / length_m, length_m / LEAST_SPACINGS), least_m)


LENGTH_RESERVE = 0.001
"""Share of a length that no path uses: rounding of written positions may add as much."""

WELL_USED = 0.95
"""A plan that uses less than this share of its length says why (Rendas and Li 2016: 5 %)."""

_STEPS_PER_M = 10
"""Lengths are reported in decimetres: in whole metres, 884 m may be too short for 884 m."""


def too_short(
    length_m: float,
    shortest_m: float,
    *,
    what: str = "the shortest path from launch to recovery",
    reserve: float = LENGTH_RESERVE,
    where: str = "length_m",
) -> Infeasible:
    """The refusal of a length that does not suffice, with the length that is necessary.

    A little more may be needed: the shortest way depends on how finely shores are drawn, and that on the length.

    Parameters
    ----------
    length_m
        What the vehicle has.
    shortest_m
        What it would need, without the reserve.
    what
        What is that long, for the message.
    reserve
        Share of the length that is kept back.
    where
        The field that the length comes from.

    Returns
    -------
    Infeasible
        To be raised by the caller.
    """
    least_m = math.ceil(_STEPS_PER_M * shortest_m / (1.0 - reserve)) / _STEPS_PER_M
    return Infeasible(
        f"is {length_m:.10g} m; expected more than {least_m:.1f} m: {what} is {shortest_m:.1f} m long, and"
        f" {reserve:.1%} is kept in reserve",
        where=where,
    )
