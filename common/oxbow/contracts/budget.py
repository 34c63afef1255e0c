"""What a vehicle's length goes for: the spacing of legs, the reserve, and the refusal of one that is too short."""

from __future__ import annotations

import math

from oxbow.errors import Infeasible

__all__ = ["LENGTH_RESERVE", "nominal_spacing_m", "too_short"]

LEAST_SPACINGS = 8
"""A path is so many spacings long at least: a short one leaves much of a large water out, however it runs."""


def nominal_spacing_m(area_m2: float, length_m: float, least_m: float = 0.0) -> float:
    """Area / length (Rendas and Li 2016, section 1.2.1.1, step 5), in metres, or the least that is wanted.

    Of a length far too short for the water, what counts is the length: at area / length it would have no legs.
    """
    return max(min(area_m2 / length_m, length_m / LEAST_SPACINGS), least_m)


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
