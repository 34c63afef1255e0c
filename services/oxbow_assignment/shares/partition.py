"""Sharing an area: every vehicle gets a connected part of the water, as large as its capacity asks for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse.csgraph import dijkstra
from shapely import Polygon

from oxbow.arrays import FloatArray, Indices, Mask, Place
from oxbow.errors import InvalidRequest
from oxbow_assignment.shares.balancing import balanced_shares, border_lengths_m, imbalance
from oxbow_assignment.shares.dues import attainable_areas_m2, due_areas_m2
from oxbow_assignment.shares.mesh import Mesh, propagate

__all__ = [
    "BALANCE",
    "Partition",
    "balanced_partition",
    "largest_piece",
    "rebalanced",
    "wavefront_partition",
]

BALANCE = 0.05
"""The greatest relative deviation of a share's area from what is due to it that counts as balanced."""

ROUNDS = 6
"""Seeds move to the middles of their shares at most this many times."""

SUBDIVISIONS = 4
"""Every triangle is divided in four at most this many times."""


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
        What every vehicle can cover, in any unit.
    """

    mesh: Mesh
    share: Indices
    depth: Indices
    seeds: tuple[int, ...]
    capacities: FloatArray

    @classmethod
    def of(cls, mesh: Mesh, share: Indices, capacities: FloatArray) -> Partition:
        """A partition whose waves start from the middles of its shares.

        Parameters
        ----------
        mesh
            The mesh.
        share
            The vehicle of every triangle, 0 to k - 1, shape (m,); no share is empty.
        capacities
            What every vehicle can cover, in any unit, shape (k,).

        Returns
        -------
        Partition
            Of the shares as they are given.
        """
        seeds = _middles(mesh, share, len(capacities))
        return cls(mesh, share, _depth(mesh, share, seeds), tuple(seeds.tolist()), capacities)

    @cached_property
    def areas_m2(self) -> FloatArray:
        """Area of every share, shape (k,)."""
        return np.bincount(self.share, self.mesh.areas_m2, minlength=len(self.seeds)).astype(float)

    @cached_property
    def due_m2(self) -> FloatArray:
        """The area due to every vehicle, in proportion to its capacity, shape (k,)."""
        return due_areas_m2(self.mesh, self.share, self.capacities)

    @property
    def imbalance(self) -> float:
        """The greatest relative deviation of a share's area from what is due."""
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
        """Length of all borders between shares: the shorter it is, the more compact the shares."""
        return float(self.borders_m.sum() / 2)


def wavefront_partition(mesh: Mesh, starts: Sequence[Place], capacities: FloatArray | None = None) -> Partition:
    """Share a mesh by antagonising wavefronts (Balampanis, Maza and Ollero 2016, Algorithm 1).

    Waves of equal speed run from the vehicles' starts; capacities do not steer them. Where several vehicles start
    in one triangle, all but one are first moved elsewhere, as far from the others as possible.

    Parameters
    ----------
    mesh
        The mesh of the area.
    starts
        Where each vehicle starts from, in planar metres.
    capacities
        What each vehicle can cover, shape (k,); all equal by default. The partition's `due_m2` follows from it.

    Returns
    -------
    Partition
        Its shares are connected, of whatever area.

    Raises
    ------
    InvalidRequest
        There are no vehicles or more than triangles, or a capacity is not positive.
    """
    capacities = _checked(mesh, starts, capacities)
    seeds = _spread(mesh, starts, capacities, _everywhere(mesh, starts))
    waves = propagate(mesh, seeds)
    return Partition(mesh, waves.source, waves.depth, tuple(seeds.tolist()), capacities)


def balanced_partition(
    mesh: Mesh, starts: Sequence[Place], capacities: FloatArray | None = None, allowed: Mask | None = None
) -> Partition:
    """Share a mesh in proportion to capacities, every share connected: within `BALANCE`, or as nearly as possible.

    The wavefronts' shares are balanced (`oxbow_assignment.shares.balancing`), their seeds move to the middles, and
    the waves run again; of all rounds, the shares with the shortest borders are taken. Where triangles are too
    large for balance, or dead ends are only one triangle wide, the mesh is divided further.

    Parameters
    ----------
    mesh
        The mesh of the area.
    starts
        Where each vehicle starts from, in planar metres; equal starts are moved apart.
    capacities
        What each vehicle can cover, shape (k,); all equal by default.
    allowed : ndarray of bool, shape (k, m)
        Which triangles each vehicle may have, at least one each; all by default. A triangle that none of its
        neighbours' vehicles may have stays with its vehicle even so.

    Returns
    -------
    Partition
        On the given mesh, or one that is divided further.

    Raises
    ------
    InvalidRequest
        There are no vehicles or more than triangles, or a capacity is not positive.
    """
    capacities = _checked(mesh, starts, capacities)
    allowed = _everywhere(mesh, starts) if allowed is None else allowed
    seeds = _spread(mesh, starts, capacities, allowed)
    share = min(_rounds(mesh, seeds, capacities, allowed), key=partial(_badness, mesh, capacities=capacities))
    # Where reach bounds the shares, it is the reach and not coarse triangles that keeps them from balance.
    for _ in range(SUBDIVISIONS if allowed.all() else 0):
        if _imbalance(mesh, share, capacities) <= BALANCE:
            break
        # Triangle t becomes 4 t to 4 t + 3.
        mesh, share, allowed = mesh.subdivided(), np.repeat(share, 4), np.repeat(allowed, 4, axis=1)
        share = _balanced(mesh, share, capacities, allowed)
    return Partition.of(mesh, share, capacities)


def rebalanced(partition: Partition, capacities: FloatArray, allowed: Mask) -> Partition:
    """A partition whose borders are moved to suit other capacities; see `balanced_partition`.

    Parameters
    ----------
    partition
        Where the borders start from.
    capacities
        What each vehicle can cover, > 0, in any unit, shape (k,).
    allowed
        Which triangles each vehicle may have, shape (k, m).

    Returns
    -------
    Partition
        On the same mesh.
    """
    mesh = partition.mesh
    share = _within_reach(mesh, partition.share, allowed)
    share = _evened(mesh, share, attainable_areas_m2(mesh, share, capacities, allowed), allowed)
    return Partition.of(mesh, share, capacities)


def _checked(mesh: Mesh, starts: Sequence[Place], capacities: FloatArray | None) -> FloatArray:
    capacities = np.ones(len(starts)) if capacities is None else np.asarray(capacities, dtype=float)
    if not 0 < len(starts) <= len(mesh):
        raise InvalidRequest(f"are {len(starts)}; expected 1 to {len(mesh)}, one per triangle", where="starts")
    if len(capacities) != len(starts):
        raise InvalidRequest(f"are {len(starts)}, with {len(capacities)} capacities", where="starts")
    for vehicle, capacity in enumerate(capacities.tolist()):
        if not 0.0 < capacity < np.inf:
            raise InvalidRequest(f"has a capacity of {capacity!r}; expected > 0", where=f"capacities[{vehicle}]")
    return capacities


def _everywhere(mesh: Mesh, starts: Sequence[Place]) -> Mask:
    return np.ones((len(starts), len(mesh)), dtype=bool)


def _rounds(mesh: Mesh, seeds: Indices, capacities: FloatArray, allowed: Mask) -> Iterator[Indices]:
    """Balanced shares from the given seeds, and from seeds that move to their middles."""
    for _ in range(ROUNDS):
        share = _matched(mesh, propagate(mesh, seeds).source, allowed)
        share = _balanced(mesh, share, capacities, allowed)
        yield share
        # As in Lloyd's relaxation: shares about their own middles are rounder, and have shorter borders.
        middles, before = _middles(mesh, share, len(capacities)), seeds
        seeds = np.where(allowed[np.arange(len(seeds)), middles], middles, seeds)
        if (seeds == before).all():
            break


def _matched(mesh: Mesh, share: Indices, allowed: Mask) -> Indices:
    """The same shares, matched to vehicles so that the least area is out of reach of its vehicle."""
    if allowed.all():
        return share
    barred_m2 = (~allowed * mesh.areas_m2) @ (share[:, None] == np.arange(len(allowed)))
    # Waves know no ranges: a vehicle of short range may have got a share far away.
    vehicles, shares = linear_sum_assignment(barred_m2)
    return np.asarray(vehicles[np.argsort(shares)][share])


def _balanced(mesh: Mesh, share: Indices, capacities: FloatArray, allowed: Mask) -> Indices:
    """Balanced shares of allowed triangles, as far as possible."""
    # Before, since only allowed triangles change hands.
    share = _within_reach(mesh, share, allowed)
    return _evened(mesh, share, due_areas_m2(mesh, share, capacities), allowed)


def _evened(mesh: Mesh, share: Indices, due_m2: FloatArray, allowed: Mask) -> Indices:
    """Shares of allowed triangles, nearer to what is due."""
    # After, since a transfer may cut some off.
    return _within_reach(mesh, balanced_shares(mesh, share, due_m2, allowed), allowed)


def _with_all(share: Indices, allowed: Mask) -> Indices:
    """Shares of which none is empty: a vehicle with nothing in reach takes a triangle of the largest share."""
    share = share.copy()
    for vehicle in np.flatnonzero(~(allowed & (share == np.arange(len(allowed))[:, None])).any(axis=1)):
        sizes = np.bincount(share, minlength=len(allowed))
        within = np.flatnonzero(allowed[vehicle])
        share[within[np.argmax(sizes[share[within]])]] = vehicle
    return share


def _within_reach(mesh: Mesh, share: Indices, allowed: Mask) -> Indices:
    """Shares without triangles that are not allowed or are cut off by them; neighbours take these where they may.

    Every share keeps its largest connected part of allowed triangles, at least one.
    """
    if allowed.all():
        return share
    share = _with_all(share, allowed)
    kept = np.zeros(len(mesh), dtype=bool)
    for vehicle, own in enumerate(allowed):
        kept |= largest_piece(mesh, own & (share == vehicle))
    while (~kept).any():
        triangle, side = np.nonzero((mesh.neighbours >= 0) & ~kept[:, None])
        beside = mesh.neighbours[triangle, side]
        takes = kept[beside] & allowed[share[beside], triangle]
        taken, first = np.unique(triangle[takes], return_index=True)
        if not len(taken):
            break
        share = share.copy()
        share[taken], kept[taken] = share[beside[takes][first]], True
    return share


def largest_piece(mesh: Mesh, which: Mask) -> Mask:
    """The connected piece of greatest area among some triangles.

    Parameters
    ----------
    mesh
        The mesh.
    which
        The triangles to look at, shape (m,); at least one.

    Returns
    -------
    ndarray of bool, shape (m,)
        Which triangles belong to that piece.
    """
    pieces = mesh.part(which).pieces
    largest = np.zeros(len(mesh), dtype=bool)
    largest[which] = pieces == np.argmax(np.bincount(pieces, mesh.areas_m2[which], minlength=1))
    return largest


def _imbalance(mesh: Mesh, share: Indices, capacities: FloatArray) -> float:
    areas_m2 = np.bincount(share, mesh.areas_m2, minlength=len(capacities)).astype(float)
    return imbalance(areas_m2, due_areas_m2(mesh, share, capacities))


def _badness(mesh: Mesh, share: Indices, *, capacities: FloatArray) -> tuple[float, float]:
    """Balance first, as long as it is worse than `BALANCE`; then the length of all borders. Less is better."""
    borders_m = border_lengths_m(mesh, share, len(capacities))
    return max(_imbalance(mesh, share, capacities), BALANCE), float(borders_m.sum())


def _depth(mesh: Mesh, share: Indices, seeds: Indices) -> Indices:
    """Steps from the seed of every triangle's share, within the share."""
    depth = np.zeros(len(mesh), dtype=np.intp)
    for vehicle, seed in enumerate(seeds.tolist()):
        own = share == vehicle
        depth[own] = propagate(mesh, [seed], own).depth[own]
    return depth


def _spread(mesh: Mesh, starts: Sequence[Place], capacities: FloatArray, allowed: Mask) -> Indices:
    """A triangle for each vehicle: that of its start, or else the one farthest by water from those taken.

    Of vehicles that start together, those of least reach and capacity choose first, which leaves what is far away
    to the others.
    """
    wanted = mesh.located(np.asarray(starts, dtype=float))
    order = np.lexsort([capacities, allowed @ mesh.areas_m2])  # by reach; the last key counts first
    seeds = np.full(len(wanted), -1)
    first = order[np.unique(wanted[order], return_index=True)[1]]
    first = first[allowed[first, wanted[first]]]
    seeds[first] = wanted[first]
    for vehicle in order[seeds[order] < 0]:
        distance = _distance_from(mesh, seeds[seeds >= 0])
        seeds[vehicle] = int(np.argmax(np.where(allowed[vehicle], distance, -1.0)))
    return seeds


def _distance_from(mesh: Mesh, triangles: Indices) -> FloatArray:
    """Metres by water from the nearest of some triangles, shape (m,); 0 everywhere if there are none."""
    if not len(triangles):
        return np.zeros(len(mesh))
    return np.asarray(dijkstra(mesh.graph, indices=triangles, min_only=True))


def _middles(mesh: Mesh, share: Indices, count: int) -> Indices:
    """The triangle of every share that is nearest to its centroid."""
    middles = []
    for vehicle in range(count):
        own = np.flatnonzero(share == vehicle)
        centroid = np.average(mesh.centroids[own], axis=0, weights=mesh.areas_m2[own])
        middles.append(own[np.argmin(np.hypot(*(mesh.centroids[own] - centroid).T))])
    return np.asarray(middles)
