"""Sharing an area: every vehicle gets a connected part of the water, as large as its capacity asks for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from scipy.sparse.csgraph import dijkstra
from shapely import Polygon

from oxbow.arrays import Indices
from oxbow.contracts import FloatArray, Place
from oxbow.errors import Infeasible, InvalidMission
from oxbow.mesh import Mesh, propagate
from oxbow_assignment.balancing import balanced_shares, border_lengths_m, imbalance

__all__ = ["BALANCE", "Partition", "balanced_partition", "wavefront_partition"]

BALANCE = 0.05
"""How far the area of a share may be from what is due to it, as a share of that."""

ROUNDS = 6
"""How often seeds move to the middle of their shares."""

SUBDIVISIONS = 4


@dataclass(frozen=True)
class Partition:
    """A mesh shared among vehicles.

    Parameters
    ----------
    mesh
        The mesh, divided further than the given one where balance asked for it.
    share : ndarray of int, shape (m,)
        The vehicle of every triangle.
    depth : ndarray of int, shape (m,)
        Steps of the vehicle's wavefront from its seed to the triangle, within its share.
    seeds
        The triangle that each wavefront started from.
    capacities : ndarray, shape (k,)
        What every vehicle can cover: its length times its speed, in any unit.
    """

    mesh: Mesh
    share: Indices
    depth: Indices
    seeds: tuple[int, ...]
    capacities: FloatArray

    @cached_property
    def areas_m2(self) -> FloatArray:
        """Area of every share, shape (k,)."""
        return np.bincount(self.share, self.mesh.areas_m2, minlength=len(self.seeds)).astype(float)

    @cached_property
    def due_m2(self) -> FloatArray:
        """The area due to every vehicle, in proportion to its capacity, shape (k,)."""
        return _due_m2(self.mesh, self.capacities)

    @property
    def imbalance(self) -> float:
        """The greatest deviation of a share's area from what is due, as a share of that."""
        return imbalance(self.areas_m2, self.due_m2)

    @cached_property
    def regions(self) -> tuple[Polygon, ...]:
        """Every share as a polygon, maybe with holes."""
        return tuple(self.mesh.region(self.share == vehicle) for vehicle in range(len(self.seeds)))

    @cached_property
    def borders_m(self) -> FloatArray:
        """Length of the border between every two shares, shape (k, k)."""
        return border_lengths_m(self.mesh, self.share, len(self.seeds))

    @property
    def border_m(self) -> float:
        """Length of all borders between shares: the less, the more compact are the shares."""
        return float(self.borders_m.sum() / 2)


def wavefront_partition(mesh: Mesh, starts: Sequence[Place], capacities: FloatArray | None = None) -> Partition:
    """Share a mesh by antagonising wavefronts (Balampanis, Maza and Ollero 2016, Algorithm 1).

    Waves of one speed run from the vehicles' starts; what capacities ask for is not looked at. Where vehicles
    start from one triangle, all but the first are sent elsewhere before, as far from the others as possible.

    Raises
    ------
    InvalidMission
        There are no vehicles or more than triangles, or a capacity is not positive.
    """
    capacities = _checked(mesh, starts, capacities)
    seeds = _spread(mesh, starts)
    waves = propagate(mesh, seeds)
    return Partition(mesh, waves.source, waves.depth, tuple(seeds.tolist()), capacities)


def balanced_partition(mesh: Mesh, starts: Sequence[Place], capacities: FloatArray | None = None) -> Partition:
    """Share a mesh in proportion to capacities, within `BALANCE`, every share connected.

    The wavefronts' shares are balanced (`oxbow_assignment.balancing`), their seeds move to their middles, and so
    on; of all rounds, the shares with the shortest borders are taken. Where triangles are too large for balance,
    or dead ends only one triangle wide, the mesh is divided further.

    Parameters
    ----------
    mesh
        The mesh of the area.
    starts
        Where each vehicle starts from, in planar metres; equal starts are spread.
    capacities
        Length times speed of each vehicle; all equal where absent.

    Raises
    ------
    InvalidMission
        There are no vehicles or more than triangles, or a capacity is not positive.
    Infeasible
        No division of the mesh balanced the shares.
    """
    capacities = _checked(mesh, starts, capacities)
    due_m2 = _due_m2(mesh, capacities)
    share = min(_rounds(mesh, _spread(mesh, starts), due_m2), key=partial(_badness, mesh, due_m2=due_m2))
    for _ in range(SUBDIVISIONS):
        if _imbalance(mesh, share, due_m2) <= BALANCE:
            break
        mesh, share = mesh.subdivided(), np.repeat(share, 4)
        share = balanced_shares(mesh, share, due_m2)
    if (found := _imbalance(mesh, share, due_m2)) > BALANCE:
        raise Infeasible(
            f"are {len(starts)}, whose shares are up to {found:.0%} from what is due; expected at most"
            f" {BALANCE:.0%}: fewer vehicles, or capacities less far apart",
            where="Vehicles",
        )
    seeds = _middles(mesh, share, len(starts))
    return Partition(mesh, share, _depth(mesh, share, seeds), tuple(seeds.tolist()), capacities)


def _checked(mesh: Mesh, starts: Sequence[Place], capacities: FloatArray | None) -> FloatArray:
    capacities = np.ones(len(starts)) if capacities is None else np.asarray(capacities, dtype=float)
    if not 0 < len(starts) <= len(mesh):
        raise InvalidMission(f"are {len(starts)}; expected 1 to {len(mesh)}, one for a triangle", where="Vehicles")
    if len(capacities) != len(starts):
        raise InvalidMission(f"are {len(starts)}, with {len(capacities)} capacities", where="Vehicles")
    for vehicle, capacity in enumerate(capacities.tolist()):
        if not 0.0 < capacity < np.inf:
            raise InvalidMission(f"has a capacity of {capacity!r}; expected > 0", where=f"Vehicles[{vehicle}]")
    return capacities


def _due_m2(mesh: Mesh, capacities: FloatArray) -> FloatArray:
    return np.asarray(mesh.areas_m2.sum() * capacities / capacities.sum())


def _rounds(mesh: Mesh, seeds: Indices, due_m2: FloatArray) -> Iterator[Indices]:
    """Balanced shares from the given seeds, and from seeds that move to their middles."""
    for _ in range(ROUNDS):
        share = balanced_shares(mesh, propagate(mesh, seeds).source, due_m2)
        yield share
        seeds, before = _middles(mesh, share, len(due_m2)), seeds
        if (seeds == before).all():
            break


def _imbalance(mesh: Mesh, share: Indices, due_m2: FloatArray) -> float:
    return imbalance(np.bincount(share, mesh.areas_m2, minlength=len(due_m2)).astype(float), due_m2)


def _badness(mesh: Mesh, share: Indices, *, due_m2: FloatArray) -> tuple[float, float]:
    """Balance first, where it is not good enough; then the length of all borders."""
    return max(_imbalance(mesh, share, due_m2), BALANCE), float(border_lengths_m(mesh, share, len(due_m2)).sum())


def _depth(mesh: Mesh, share: Indices, seeds: Indices) -> Indices:
    """Steps from the seed of every triangle's share, within the share."""
    depth = np.zeros(len(mesh), dtype=np.intp)
    for vehicle, seed in enumerate(seeds.tolist()):
        own = share == vehicle
        depth[own] = propagate(mesh, [seed], own).depth[own]
    return depth


def _spread(mesh: Mesh, starts: Sequence[Place]) -> Indices:
    """A triangle for each vehicle: that of its start, or else the one farthest by water from those taken."""
    wanted = mesh.located(np.asarray(starts, dtype=float))
    first = np.unique(wanted, return_index=True)[1]
    seeds = np.full(len(wanted), -1)
    seeds[first] = wanted[first]
    for vehicle in np.flatnonzero(seeds < 0):
        distance = dijkstra(mesh.graph, indices=seeds[seeds >= 0], min_only=True)
        seeds[vehicle] = int(np.argmax(distance))
    return seeds


def _middles(mesh: Mesh, share: Indices, count: int) -> Indices:
    """The triangle of every share that is nearest to its centroid."""
    middles = []
    for vehicle in range(count):
        own = np.flatnonzero(share == vehicle)
        centroid = np.average(mesh.centroids[own], axis=0, weights=mesh.areas_m2[own])
        middles.append(own[np.argmin(np.hypot(*(mesh.centroids[own] - centroid).T))])
    return np.asarray(middles)
