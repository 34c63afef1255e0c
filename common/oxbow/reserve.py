"""What is kept back of a vehicle's length, and how a length that is too short is refused."""

from __future__ import annotations

import math

from oxbow.errors import Infeasible

__all__ = ["LENGTH_RESERVE", "WELL_USED", "too_short"]

LENGTH_RESERVE = 0.001
"""Share of a length that no path uses: what the rounding of written positions may add."""

WELL_USED = 0.95
"""Share of a length below which a plan says why it does not use more (Rendas and Li 2016: 5 %)."""

_STEPS_PER_M = 10
"""Lengths are told in decimetres: in whole metres, 884 m may be too short for 884 m."""


def too_short(
    length_m: float,
    shortest_m: float,
    *,
    what: str = "the shortest path from launch to recovery",
    reserve: float = LENGTH_RESERVE,
    where: str = "Master_length",
) -> Infeasible:
    """The refusal of a length that does not suffice, with what is necessary.

    It may take a little more: how short a way is depends on how finely shores are drawn, and that on the length.

    Parameters
    ----------
    length_m
        What the vehicle has.
    shortest_m
        What it would need, without the reserve.
    what
        What that is the length of.
    reserve
        Share of the length that is kept back.
    where
        The field that the length comes from.
    """
    least_m = math.ceil(_STEPS_PER_M * shortest_m / (1.0 - reserve)) / _STEPS_PER_M
    return Infeasible(
        f"is {length_m:.10g} m; expected more than {least_m:.1f} m: {what} is {shortest_m:.1f} m long, and"
        f" {reserve:.1%} is kept in reserve",
        where=where,
    )
