"""Danger zones: the cost of travelling through them, and the probability of harm on the way.

M. Innocenti, L. Pollini and A. Bracci (2006), section 3. A route of L edges k, with probabilities of harm P_k,
has the probability of harm P_P = 1 - prod(1 - P_k). In the report an edge of length c_k costs
c_k + c_MAX log(a / (1 - P_k)), so that costs add up along a route while probabilities multiply:
W_P = sum(c_k) + c_MAX (L log(a) - log(1 - P_P)).

Departure: in this module W_P = sum(c_k) - c_MAX a log(1 - P_P). The report's term L log(a) counts edges, dangerous
or not: it depends on how a route is divided, and sends a vehicle of large a through a zone wherever the way round
it has more edges: the less fit vehicle goes where the fitter one does not. As a factor of the hazard
-log(1 - P_k), a acts where danger is and nowhere else: one crossing counts for a vehicle of factor a as a
crossings for one of factor 1. Of two cheapest routes, that for the larger a never has the greater P_P: W_P is a
length plus a times a hazard, and what minimises such a sum has the less of a term the more that counts.

Further departures: a zone's probability holds for each metre or for each crossing, and P_k of an edge follows from
how much of the zone it passes, so that W_P and P_P do not depend on how a route is divided into edges; a zone
without danger changes no route; a is at least 1, the fittest vehicle's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely import STRtree
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray, Mask
from oxbow.contracts import DangerZone, Per
from oxbow.errors import InvalidRequest

__all__ = ["NO_DANGER", "Danger"]

RIM_M = 1e-6
"""Width of a zone's rim that does not count: a route along the outline is outside, however it is rounded."""


@dataclass(frozen=True)
class Danger:
    """All danger zones, and how much they count for one vehicle.

    Parameters
    ----------
    zones
        The areas of danger; they may overlap.
    c_max_m
        The report's c_max: the detour, in metres, that raising the chance of no harm by a factor of e is worth.
    a
        The report's a, >= 1: how many times as much a hazard counts for a vehicle less fit for it.

    Raises
    ------
    InvalidRequest
        A parameter is out of range.
    """

    zones: tuple[DangerZone, ...] = ()
    c_max_m: float = 0.0
    a: float = 1.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.c_max_m < math.inf:
            raise InvalidRequest(f"is {self.c_max_m!r}; expected a finite number, >= 0", where="c_max_m")
        if not 1.0 <= self.a < math.inf:
            raise InvalidRequest(f"is {self.a!r}; expected a finite number, >= 1", where="a")

    def costs(self, starts: FloatArray, ends: FloatArray) -> FloatArray:
        """Costs of straight edges.

        Parameters
        ----------
        starts, ends : ndarray, shape (n, 2)
            In metres.

        Returns
        -------
        ndarray, shape (n,)
            In metres: length, plus `hazard_m` times the hazard. What starting inside a zone costs is not
            included (`hazards_at`).
        """
        length = np.hypot(*(ends - starts).T)
        return np.asarray(length + self.hazard_m * self.hazards(starts, ends))

    @property
    def hazard_m(self) -> float:
        """What a hazard of 1 costs, in metres: c_MAX a."""
        return self.c_max_m * self.a

    @cached_property
    def outlines(self) -> tuple[BaseGeometry, ...]:
        """Where costs change: the outlines of all zones that do harm."""
        return tuple(zone.area.boundary for zone in self.zones if zone.hazard > 0.0)

    def hazards(self, starts: FloatArray, ends: FloatArray) -> FloatArray:
        """Hazards of straight edges, -log(1 - P).

        Parameters
        ----------
        starts, ends : ndarray, shape (n, 2)
            In metres.

        Returns
        -------
        ndarray, shape (n,)
            Summed over the zones. A zone counts once for each time that the edge enters it, or for each metre
            inside. An edge that starts inside has entered before: that crossing is counted by `hazards_at`.
        """
        total = np.zeros(len(starts))
        if not self.zones or not len(starts):
            return total
        lines = np.asarray(shapely.linestrings(np.stack([starts, ends], axis=1)))
        # Zones are few and edges many: the tree is one of edges, and each zone asks for those that it meets.
        tree = STRtree(lines)
        for zone, core in zip(self.zones, self._cores, strict=True):
            met = tree.query(core, predicate="intersects")
            inside = shapely.intersection(lines[met], core)
            if zone.per is Per.METRE:
                total[met] += zone.hazard * shapely.length(inside)
            else:
                # Each part of the edge inside is one entry, except the part that the edge starts in.
                entered = shapely.get_num_geometries(inside) - _is_inside(core, starts[met])
                total[met] += zone.hazard * np.maximum(entered, 0)
        return total

    def hazards_at(self, starts: FloatArray) -> FloatArray:
        """-log(1 - P) of starting at places, shape (n, 2): a crossing of each zone they lie in; shape (n,)."""
        total = np.zeros(len(starts))
        for zone, core in zip(self.zones, self._cores, strict=True):
            if zone.per is Per.CROSSING:
                total += zone.hazard * _is_inside(core, starts)
        return total

    def probability(self, polyline: FloatArray) -> float:
        """The probability of harm along a polyline, shape (n, 2): 1 - prod(1 - P_k) over its edges."""
        starts, ends = polyline[:-1], polyline[1:]
        hazard = self.hazards_at(starts[:1]).sum() + self.hazards(starts, ends).sum()
        # expm1 keeps the digits of small hazards, which 1 - exp(-hazard) would lose.
        return -math.expm1(-hazard)

    @cached_property
    def _cores(self) -> tuple[BaseGeometry, ...]:
        """The zones' areas without their rims, prepared."""
        # Mitred: round joins would add vertices at the corners of zones.
        cores = tuple(zone.area.buffer(-RIM_M, join_style="mitre") for zone in self.zones)
        shapely.prepare(cores)
        return cores


NO_DANGER = Danger()


def _is_inside(core: BaseGeometry, places: FloatArray) -> Mask:
    return np.asarray(shapely.contains_xy(core, places))
