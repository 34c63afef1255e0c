"""What rounding can do to coordinates, how large they can be, and how exact a mission is taken to be."""

from __future__ import annotations

__all__ = [
    "DEFAULT_LEAST_WIDTH_M",
    "DEFAULT_SHORE_TOLERANCE_M",
    "DISTANCE_ROUNDING",
    "FARTHEST_M",
    "HAIR_M",
    "ON_SHORE_M",
    "ROUNDING",
    "ROUNDING_M",
]

FARTHEST_M = 2.1e7
"""No place on Earth is farther from the origin of a mission's plane, an azimuthal equidistant projection."""

ROUNDING_M = 1e-6
"""Places nearer to each other than this are one, and one this near to an area is in it: to project, turn and
intersect moves places by far less."""

ROUNDING = 2.0**-48
"""How exact coordinates are, as a share of the greatest one: a few units in the last place."""

DISTANCE_ROUNDING = 1e-9
"""Distances and offsets that are computed in two ways agree to this share."""

ON_SHORE_M = 5e-3
"""A place ashore that is no farther than this from the water is on its shore: degrees of seven decimals are a
centimetre."""

HAIR_M = 1e-3
"""How far apart the ways out and home run over land: each as straight as can be measured."""

DEFAULT_SHORE_TOLERANCE_M = 25.0
"""How far ashore a vehicle may start or be recovered."""

DEFAULT_LEAST_WIDTH_M = 0.1
"""Water narrower than this is not water."""
