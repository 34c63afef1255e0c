"""Ragged lakes of any size, made from seeded noise on circles: the same arguments give the same lake."""

from __future__ import annotations

import math
from functools import partial

import msgspec
import numpy as np
import shapely
from shapely import Polygon

from oxbow.arrays import FloatArray
from oxbow.geometry.frame import Frame, Position
from oxbow.mission.file import Mission, MissionType

__all__ = ["lake", "with_spacings"]

RADIUS_M = 2_000.0
ISLANDS_WITHIN = 0.55
"""Islands stand within this share of the lake's radius."""

LEAST_VERTICES = 8
"""Of an island."""

ROUGHNESS = 0.08
"""Standard deviation of a contour's radius, as a share of it."""

FRACTAL_DIMENSION = 1.25
"""As the west coast of Britain's (Mandelbrot 1967)."""

GOLDEN_ANGLE_RAD = math.pi * (3.0 - math.sqrt(5.0))
PLACE = np.array([[9.0, 47.0]])
"""Longitude and latitude of the middle of every lake."""


def lake(
    vertices: int, islands: int = 0, *, spacings: float = 40.0, safety_m: float = 10.0, seed: int = 0
) -> Mission:
    """A mission on a lake of so many vertices, half of them on islands where there are any.

    Parameters
    ----------
    spacings
        Nominal spacings that fit the square root of the water's area, which sets the length; see `with_spacings`.
    """
    rng = np.random.default_rng(seed)
    on_islands = vertices // 2 if islands else 0
    shore = _ragged_circle(vertices - on_islands, RADIUS_M, rng)
    rims = []
    for number in range(islands):
        # Vogel's spiral: evenly spread, with room for an island around each place.
        distance_m = ISLANDS_WITHIN * RADIUS_M * math.sqrt((number + 0.5) / islands)
        angle_rad = number * GOLDEN_ANGLE_RAD
        middle = distance_m * np.array([math.cos(angle_rad), math.sin(angle_rad)])
        radius_m = 0.35 * ISLANDS_WITHIN * RADIUS_M / math.sqrt(islands)
        rims.append(middle + _ragged_circle(max(on_islands // islands, LEAST_VERTICES), radius_m, rng))
    positions = partial(_positions, Frame.around(PLACE))
    mission = Mission(
        mission_type=MissionType.MAP,
        site_name=f"{vertices} vertices, {islands} islands",
        launch=positions(shore[:1])[0],
        outline=positions(shore),
        forbidden_zones=tuple(map(positions, rims)),
        safety_m=safety_m,
    )
    return with_spacings(mission, spacings, area_m2=Polygon(shore, rims).area)


def with_spacings(mission: Mission, spacings: float, *, area_m2: float) -> Mission:
    """The mission with a length of so many times the square root of its area."""
    return msgspec.structs.replace(mission, master_length_m=spacings * math.sqrt(area_m2))


def _ragged_circle(vertices: int, radius_m: float, rng: np.random.Generator) -> FloatArray:
    """A circle whose radius is noise: simple, and as ragged at every scale as a coast of `FRACTAL_DIMENSION`."""
    order = np.arange(vertices // 2 + 1)
    spectrum = rng.normal(size=len(order)) * np.exp(1j * rng.uniform(0.0, 2.0 * np.pi, len(order)))
    spectrum[:2] = 0.0
    noise = np.fft.irfft(spectrum / np.maximum(order, 1) ** (2.5 - FRACTAL_DIMENSION), vertices)
    radius = radius_m * np.clip(1.0 + ROUGHNESS * noise / noise.std(), 0.5, 1.4)
    angle = 2.0 * np.pi * np.arange(vertices) / vertices
    ring = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    assert shapely.is_valid(Polygon(ring))
    return ring


def _positions(frame: Frame, xy: FloatArray) -> tuple[Position, ...]:
    return tuple(Position(lat=lat, long=long) for long, lat in frame.to_degrees(xy).tolist())
