"""Sharing the free space among the masters: each surveys a connected part, as large as its range asks for.

What a vehicle can cover is what its way there and home leaves of its range. Ways depend on shares, so shares are
rebalanced repeatedly by what the ways to them leave. Speed does not count: a vehicle uses its whole range, however
fast it is. Water that no vehicle can survey and still get home within its range belongs to no share.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon

from oxbow.arrays import FloatArray, Mask, Place
from oxbow.contracts import DroppedPart, Vehicle, dropped_warnings
from oxbow.errors import InvalidRequest
from oxbow_assignment.shares.balancing import imbalance
from oxbow_assignment.shares.dues import due_areas_m2
from oxbow_assignment.shares.mesh import Mesh, mesh_area, propagate
from oxbow_assignment.shares.partition import (
    BALANCE,
    Partition,
    balanced_partition,
    largest_piece,
    rebalanced,
)
from oxbow_assignment.shares.reach import Reach

__all__ = ["Sharing", "share_water"]

TRIANGLES = 400
"""Approximate number of triangles per share, where the footprint is not given."""

MOST_TRIANGLES = 200_000
"""A mesh of more triangles takes minutes and makes no share better."""

ROUNDS = 8
"""Shares are rebalanced by what their ways leave at most this many times."""

SETTLED = 0.02
"""Shares that deviate by less than this fraction of what is due are not rebalanced."""

SPACING_POWER = 4
"""The integral of this power of the spacing over all water is a smooth stand-in for the greatest spacing."""

TOO_FAR = "too far for the vehicles: none can go there and home within its length"
BOXED_IN = "too far for the vehicles whose shares border on it; others would have to cross these"


@dataclass(frozen=True)
class Sharing:
    """The free space, divided into shares.

    Parameters
    ----------
    areas
        One connected polygon per master, in their order; with `dropped` they make up the free space.
    imbalance
        The greatest relative deviation of a share's area from what is due to it.
    dropped
        Water that no master can survey and still get home within its range.
    warnings
        Warnings about shares that could not be balanced.
    partition
        The mesh that was shared; None if a single master has all of the free space.
    """

    areas: tuple[Polygon, ...]
    imbalance: float = 0.0
    dropped: tuple[DroppedPart, ...] = ()
    warnings: tuple[str, ...] = ()
    partition: Partition | None = None


def share_water(
    free: Polygon, masters: Sequence[Vehicle], footprint_m: float | None = None, water: Polygon | None = None
) -> Sharing:
    """Share the free space in proportion to what each master can cover: the range that its ways leave.

    Antagonising wavefronts over a mesh make the shares, which are then balanced (Balampanis, Maza and Ollero 2016,
    Algorithm 1 and section VIII); see `balanced_partition`. Starts may coincide or lie ashore: waves
    begin in the nearest triangle.

    Parameters
    ----------
    free
        The free space.
    masters
        One or more vehicles.
    footprint_m
        The longest edge of the mesh; by default such that a share has about `TRIANGLES` triangles.
    water
        What legs to and from the free space may cross; by default the free space alone.

    Returns
    -------
    Sharing
        Its areas are of water that each master can reach.

    Raises
    ------
    InvalidRequest
        There is no master, or the footprint is so small that meshing would take minutes.
    Infeasible
        A master cannot reach any of the free space and be home within its range.
    """
    if not masters:
        raise InvalidRequest("has no master; expected one or more to share the free space", where="vehicles")
    if len(masters) == 1:
        return Sharing((free,))
    mesh = mesh_area(free, _footprint_m(free, len(masters), footprint_m))
    reach = Reach.of(mesh, masters, free, water)
    within = _within_reach(mesh, reach)
    reach = reach.among(within)
    docks: list[Place] = [(x, y) for x, y in reach.docks.tolist()]
    # Ways to shares are not known before there are shares: the first ones take what the legs leave.
    partition = balanced_partition(mesh.part(within), docks, reach.lengths_m - reach.legs_m, reach.allowed)
    # Balancing may have divided the mesh further: its triangles keep the ways of those that they are parts of.
    reach = reach.on(partition.mesh)
    partition = _by_length_left(partition, reach)
    own = _own(partition, reach)
    uneven = _imbalance(partition, reach)
    dropped = (
        *_dropped(mesh, within, TOO_FAR),
        *_dropped(partition.mesh, np.logical_or.reduce(own), BOXED_IN),
    )
    return Sharing(
        areas=tuple(partition.mesh.region(triangles) for triangles in own),
        imbalance=uneven,
        dropped=dropped,
        warnings=(
            *((_uneven(partition, reach, masters),) if uneven > BALANCE else ()),
            *dropped_warnings(dropped, free.area, "the water"),
        ),
        partition=partition,
    )


def _footprint_m(free: Polygon, masters: int, footprint_m: float | None) -> float:
    if footprint_m is None:
        return _edge_m(free, TRIANGLES * masters)
    if footprint_m < (least_m := _edge_m(free, MOST_TRIANGLES)):
        raise InvalidRequest(
            f"is {footprint_m:g} m; for this water expected {least_m:.3g} m or more, or none", where="footprint_m"
        )
    return footprint_m


def _edge_m(area: Polygon, triangles: int) -> float:
    """The edge of equilateral triangles that fill an area or, if it is thin, line its border; in metres."""
    return max(math.sqrt(4.0 / math.sqrt(3.0) * area.area / triangles), area.length / triangles)


def _within_reach(mesh: Mesh, reach: Reach) -> Mask:
    """The triangles within reach of some vehicle that are connected to its nearest one, shape (m,)."""
    # Reach is judged at centroids, so a triangle may be within reach beyond one that is not. A share is connected:
    # such an island is of no use to it.
    first = np.argmin(reach.out_m + reach.home_m, axis=1)
    return propagate(mesh, first, np.logical_or.reduce(reach.allowed)).source >= 0


def _by_length_left(partition: Partition, reach: Reach) -> Partition:
    """Shares balanced by what the ways to them leave: within `SETTLED`, or as well as was found."""
    # A border that moves changes the ways, and they may jump: rounds need not converge, so the best one is kept.
    best, least = partition, _badness(partition, reach)
    for _ in range(ROUNDS):
        if _imbalance(partition, reach) <= SETTLED:
            return partition
        partition = rebalanced(partition, reach.left_m(partition.share), reach.allowed)
        if (badness := _badness(partition, reach)) < least:
            best, least = partition, badness
    return best


def _badness(partition: Partition, reach: Reach) -> float:
    """A smooth stand-in for the greatest spacing of shares; less is better."""
    return float((partition.areas_m2 * _spacings_m(partition, reach) ** SPACING_POWER).sum())


def _spacings_m(partition: Partition, reach: Reach) -> FloatArray:
    """The approximate spacing of every vehicle's legs, shape (k,): the area of its share over the length left."""
    return np.asarray(partition.areas_m2 / reach.left_m(partition.share))


def _imbalance(partition: Partition, reach: Reach) -> float:
    """The greatest relative deviation of a share's area from what the lengths left ask for."""
    due_m2 = due_areas_m2(partition.mesh, partition.share, reach.left_m(partition.share))
    return imbalance(partition.areas_m2, due_m2)


def _own(partition: Partition, reach: Reach) -> Mask:
    """The triangles that each vehicle surveys, shape (k, m): connected, within its reach."""
    own = [largest_piece(partition.mesh, each & (partition.share == k)) for k, each in enumerate(reach.allowed)]
    return np.array(own)


def _dropped(mesh: Mesh, kept: Mask, reason: str) -> Iterator[DroppedPart]:
    """The triangles that are not `kept`, as water that is left out; the largest part first."""
    parts = shapely.get_parts(shapely.coverage_union_all(mesh.polygons[~kept]))
    for part in parts[np.argsort(-shapely.area(parts), kind="stable")].tolist():
        place = part.representative_point()
        yield DroppedPart(
            area_m2=part.area,
            reason=reason,
            place=(place.x, place.y),
            outline=part,
        )


def _uneven(partition: Partition, reach: Reach, masters: Sequence[Vehicle]) -> str:
    """A warning that names the shares that differ most, and what would help."""
    spacings_m = _spacings_m(partition, reach)
    dense, sparse = (masters[int(which)].name for which in (spacings_m.argmin(), spacings_m.argmax()))
    return (
        f"shares are not even: {dense} can leave {spacings_m.min():.3g} m between its legs, {sparse}"
        f" {spacings_m.max():.3g} m, since ways there use up length: start vehicles apart, or give more length"
    )
