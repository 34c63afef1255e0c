"""What is kept back of a vehicle's length, and how a length that is too short is refused."""

from __future__ import annotations

import math

from oxbow.errors import Infeasible

__all__ = ["LENGTH_RESERVE", "too_short"]

LENGTH_RESERVE = 0.001
"""Share of a length that no path uses: what the rounding of written positions may add."""

_STEPS_PER_M = 10
"""Lengths are told in decimetres: in whole metres, 884 m may be too short for 884 m."""


def too_short(
    length_m: float,
    shortest_m: float,
    *,
    what: str = "the shortest path from launch to recovery",
    reserve: float = LENGTH_RESERVE,
    where: str = "Master_length",
    suffices: bool = True,
) -> Infeasible:
    """The refusal of a length that does not suffice, with one that does, or that is necessary.

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
    suffices
        Whether as much is known to do.
    """
    least_m = math.ceil(_STEPS_PER_M * shortest_m / (1.0 - reserve)) / _STEPS_PER_M
    expected = f"at least {least_m:.1f} m" if suffices else f"more than {least_m:.1f} m"
    return Infeasible(
        f"is {length_m:.10g} m; expected {expected}: {what} is {shortest_m:.1f} m long, and {reserve:.1%} is kept"
        " in reserve",
        where=where,
    )
