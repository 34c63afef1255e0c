"""How far each vehicle has to travel to the triangles of a mesh, and what of its range that leaves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from shapely import LineString, Polygon

from oxbow.arrays import FloatArray, Indices, Mask
from oxbow.contracts import Vehicle
from oxbow.contracts.budget import too_short
from oxbow.geometry.route import leg_routes, lengths_from, way_to
from oxbow_assignment.shares.mesh import Mesh

__all__ = ["Reach"]

LEAST_LEFT = 1e-3
"""The least fraction of a range that counts as left for surveying, so that capacities stay positive."""

SPARE = 0.01
"""Fraction of a range that is kept back, because legs do not run exactly along the shortest way."""


@dataclass(frozen=True)
class Reach:
    """Ways of k vehicles to the m triangles of a mesh.

    Parameters
    ----------
    out_m, home_m : ndarray, shape (k, m)
        Metres from each vehicle's start to every triangle's centroid, and from there to its recovery; legs outside
        the free space included.
    lengths_m : ndarray, shape (k,)
        Each vehicle's range, in metres.
    legs_m : ndarray, shape (k,)
        The part of it that the legs outside the free space take.
    docks : ndarray, shape (k, 2)
        Where each vehicle enters the free space.
    first, last : ndarray of int, shape (k,)
        The triangles where each vehicle enters and leaves the free space; -1 if they are not in this mesh.
    """

    out_m: FloatArray
    home_m: FloatArray
    lengths_m: FloatArray
    legs_m: FloatArray
    docks: FloatArray
    first: Indices
    last: Indices

    @classmethod
    def of(cls, mesh: Mesh, vehicles: Sequence[Vehicle], free: Polygon, water: Polygon | None) -> Reach:
        """The ways of vehicles through the free space, and through water to it.

        Parameters
        ----------
        mesh
            The mesh of the free space.
        vehicles
            At least one.
        free
            The free space.
        water
            What legs to and from the free space may cross; None for the free space alone.

        Returns
        -------
        Reach
            For the triangles of this mesh.

        Raises
        ------
        Infeasible
            A vehicle's range is too short to survey any of the free space and go home; names the vehicle.
        """
        # The legs: from where each vehicle starts and is recovered to the free space.
        shore = leg_routes(free, free if water is None else water)
        ways = [
            way_to(free, shore, getattr(vehicle, end), where=vehicle.field(end))
            for end in ("start", "recovery")
            for vehicle in vehicles
        ]
        legs_m = np.array([LineString(way).length for way in ways])
        docks = np.array([way[-1] for way in ways])
        # Vehicles often share their launch and recovery points: each distinct dock is searched from once.
        places, row = np.unique(docks, axis=0, return_inverse=True)
        # And on from there, to the middle of every triangle.
        from_docks = lengths_from(free, places, mesh.centroids)[row] + legs_m[:, None]
        count = len(vehicles)
        nearest = mesh.located(docks)
        reach = cls(
            out_m=from_docks[:count],
            home_m=from_docks[count:],
            lengths_m=np.array([vehicle.length_m for vehicle in vehicles]),
            legs_m=legs_m[:count] + legs_m[count:],
            docks=docks[:count],
            first=nearest[:count],
            last=nearest[count:],
        )
        reach._require_any(vehicles)
        return reach

    @cached_property
    def allowed(self) -> Mask:
        """Which triangles each vehicle can reach and still get home within its range, shape (k, m)."""
        return self.out_m + self.home_m <= (1.0 - SPARE) * self.lengths_m[:, None]

    def among(self, triangles: Mask) -> Reach:
        """The ways to some of the triangles, which become a mesh of their own; a mask of shape (m,)."""
        rank = np.cumsum(triangles) - 1
        nearest = [np.where(triangles[own], rank[own], -1) for own in (self.first, self.last)]
        return replace(
            self,
            out_m=self.out_m[:, triangles],
            home_m=self.home_m[:, triangles],
            first=nearest[0],
            last=nearest[1],
        )

    def on(self, mesh: Mesh) -> Reach:
        """The ways to the triangles of this mesh as it is, or divided further (`Mesh.subdivided`).

        The parts of a triangle have its ways; the first part stands for it as a dock.
        """
        times = len(mesh) // self.out_m.shape[1]
        return replace(
            self,
            out_m=np.repeat(self.out_m, times, axis=1),
            home_m=np.repeat(self.home_m, times, axis=1),
            first=np.where(self.first < 0, -1, times * self.first),
            last=np.where(self.last < 0, -1, times * self.last),
        )

    def left_m(self, share: Indices) -> FloatArray:
        """What its way leaves of each vehicle's range for its share, in metres, shape (k,).

        A vehicle that enters the free space in its share starts to survey at once, and one that leaves it there is
        home. Others take the shortest way to their share and home. `share` is the vehicle of each triangle,
        shape (m,).
        """
        left = [self._left_m(vehicle, share == vehicle) for vehicle in range(len(self.lengths_m))]
        return np.maximum(left, LEAST_LEFT * self.lengths_m)

    def _left_m(self, vehicle: int, own: Mask) -> float:
        out_m, home_m = self.out_m[vehicle, own], self.home_m[vehicle, own]
        starts, ends = (bool(at[vehicle] >= 0 and own[at[vehicle]]) for at in (self.first, self.last))
        way_m = self.legs_m[vehicle]
        if not (starts and ends):
            # The nearest triangle stands for the share: from there on, the vehicle surveys.
            way_m = (home_m if starts else out_m if ends else out_m + home_m).min()
        return float(self.lengths_m[vehicle] - way_m)

    def _require_any(self, vehicles: Sequence[Vehicle]) -> None:
        least_m = (self.out_m + self.home_m).min(axis=1)
        for vehicle, own, way_m in zip(vehicles, self.allowed, least_m, strict=True):
            if not own.any():
                raise too_short(
                    vehicle.length_m,
                    way_m,
                    what="the way to the nearest water and home",
                    reserve=SPARE,
                    where=vehicle.field("length_m"),
                )
