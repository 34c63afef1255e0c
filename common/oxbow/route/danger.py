"""Danger zones: what it may cost to travel through them, and how probable harm is on the way.

M. Innocenti, L. Pollini and A. Bracci (2006), section 3. A route of edges k that do harm with probabilities P_k
does harm with P = 1 - prod(1 - P_k); an edge of length c costs c + c_max log(a / (1 - P_k)), so that costs add up
along a route while probabilities multiply.

Departures: a zone's probability holds for each metre or for each crossing, and P_k of an edge follows from how
much of the zone it passes, so that P does not depend on how a route is divided into edges; without zones the term
is left out altogether, whatever `a`; `a` is at least 1, for Dijkstra's algorithm takes no negative costs.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon, STRtree
from shapely.geometry.base import BaseGeometry

from oxbow.contracts import FloatArray
from oxbow.errors import InvalidMission

__all__ = ["NO_DANGER", "Danger", "DangerZone", "Per"]

RIM_M = 1e-6
"""What of a zone's rim is not in it: a route along the outline runs outside, however it is rounded."""


class Per(enum.StrEnum):
    """What a zone's probability refers to."""

    METRE = "metre"
    CROSSING = "crossing"


@dataclass(frozen=True)
class DangerZone:
    """An area that may be travelled, at a risk.

    Parameters
    ----------
    name
        What errors call it.
    area
        Its outline; a boat on the outline is outside.
    probability
        Of harm, 0 <= probability < 1, for each metre inside or for each crossing.
    per
        Which of the two. A crossing lasts from where a route enters the area, or starts in it, to where it leaves.

    Raises
    ------
    InvalidMission
        The probability is out of range, or the area is empty or not valid; names the zone.
    """

    name: str
    area: Polygon
    probability: float
    per: Per = Per.METRE

    def __post_init__(self) -> None:
        if not 0.0 <= self.probability < 1.0:
            raise InvalidMission(
                f"has danger {self.probability!r}; expected 0 <= danger < 1 (what must not be entered is a"
                " forbidden zone)",
                where=self.name,
            )
        if self.area.is_empty or not self.area.is_valid:
            raise InvalidMission("is empty or not a valid polygon", where=self.name)

    @property
    def hazard(self) -> float:
        """-log(1 - probability): hazards add up where probabilities of no harm multiply."""
        return -math.log1p(-self.probability)

    @cached_property
    def core(self) -> BaseGeometry:
        """The area without its rim."""
        core = self.area.buffer(-RIM_M, join_style="mitre")
        shapely.prepare(core)
        return core


@dataclass(frozen=True)
class Danger:
    """All danger zones, and what one vehicle makes of them.

    Parameters
    ----------
    zones
        Where danger is; zones may overlap.
    c_max_m
        The report's c_max: the detour, in metres, that a chance of no harm e times as good is worth.
    a
        The report's a, >= 1: each edge of a route costs c_max log(a) more for a vehicle less fit for it.

    Raises
    ------
    InvalidMission
        A parameter is out of range.
    """

    zones: tuple[DangerZone, ...] = ()
    c_max_m: float = 0.0
    a: float = 1.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.c_max_m < math.inf:
            raise InvalidMission(f"is {self.c_max_m!r}; expected a finite number, >= 0", where="c_max_m")
        if not 1.0 <= self.a < math.inf:
            raise InvalidMission(f"is {self.a!r}; expected a finite number, >= 1", where="a")

    def costs(self, starts: FloatArray, ends: FloatArray) -> FloatArray:
        """Costs in metres, shape (n,), of the straight edges from `starts` to `ends`, both of shape (n, 2)."""
        length = np.hypot(*(ends - starts).T)
        if not self.zones:
            return np.asarray(length)
        return np.asarray(length + self.c_max_m * (math.log(self.a) + self.hazards(starts, ends)))

    def hazards(self, starts: FloatArray, ends: FloatArray) -> FloatArray:
        """-log(1 - P) of straight edges, shape (n,); who starts inside a zone has entered it before."""
        total = np.zeros(len(starts))
        if not self.zones or not len(starts):
            return total
        lines = np.asarray(shapely.linestrings(np.stack([starts, ends], axis=1)))
        tree = STRtree(lines)
        for zone in self.zones:
            met = tree.query(zone.core, predicate="intersects")
            inside = shapely.intersection(lines[met], zone.core)
            if zone.per is Per.METRE:
                total[met] += zone.hazard * shapely.length(inside)
            else:
                entered = shapely.get_num_geometries(inside) - _is_inside(zone, starts[met])
                total[met] += zone.hazard * np.maximum(entered, 0)
        return total

    def hazards_at(self, starts: FloatArray) -> FloatArray:
        """-log(1 - P) of starting at places, shape (n, 2): a crossing of each zone they lie in; shape (n,)."""
        total = np.zeros(len(starts))
        for zone in self.zones:
            if zone.per is Per.CROSSING:
                total += zone.hazard * _is_inside(zone, starts)
        return total


NO_DANGER = Danger()


def _is_inside(zone: DangerZone, places: FloatArray) -> npt.NDArray[np.bool_]:
    return np.asarray(shapely.contains_xy(zone.core, places))
