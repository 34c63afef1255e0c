"""The nominal spacing of a path's legs: what all stages measure detail by."""

from __future__ import annotations

__all__ = ["nominal_spacing_m"]

LEAST_SPACINGS = 8
"""A path is so many spacings long at least: a short one leaves much of a large water out, however it runs."""


def nominal_spacing_m(area_m2: float, length_m: float, least_m: float = 0.0) -> float:
    """Area / length (Rendas and Li 2016, section 1.2.1.1, step 5), in metres, or the least that is wanted.

    Of a length far too short for the water, what counts is the length: at area / length it would have no legs.
    """
    return max(min(area_m2 / length_m, length_m / LEAST_SPACINGS), least_m)
