"""Sharing the free space among the masters: each surveys a connected part, as large as its range asks for.

What a vehicle can cover is what its way there and home leaves of its range. Ways depend on shares: so these are
balanced by what the ways to them leave, again and again. Speed does not count: a vehicle uses its whole range,
however fast. Water that no vehicle can see and be home within its range is nobody's.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon

from oxbow.arrays import FloatArray, Mask, Place
from oxbow.contracts import DroppedPart, Vehicle
from oxbow.errors import InvalidMission
from oxbow_assignment.shares.balancing import imbalance
from oxbow_assignment.shares.mesh import Mesh, mesh_area, propagate
from oxbow_assignment.shares.partition import (
    BALANCE,
    Partition,
    balanced_partition,
    due_areas_m2,
    largest_piece,
    rebalanced,
)
from oxbow_assignment.shares.reach import Reach

__all__ = ["Sharing", "shared"]

TRIANGLES = 400
"""Triangles of a share, about, where the footprint is not given."""

MOST_TRIANGLES = 200_000
"""More than these take minutes, and no share gets better by them."""

ROUNDS = 8
"""How often shares are balanced anew by what their ways leave, at most."""

SETTLED = 0.02
"""Shares that are so near to what is due are not balanced anew."""

SPACING_POWER = 4
"""The sum of this power of spacings, over all water, stands for the greatest spacing."""

TOO_FAR = "too far for the vehicles: none can go there and home within its length"
BOXED_IN = "too far for the vehicles whose shares border on it; others would have to cross these"


@dataclass(frozen=True)
class Sharing:
    """The free space in shares.

    Parameters
    ----------
    areas
        One connected polygon a master, in their order; together with what is dropped the free space.
    imbalance
        The greatest deviation of a share's area from what is due to it, as a share of that.
    dropped
        What no master can see and be home within its range.
    warnings
        What is to be known of shares that could not be balanced.
    partition
        The mesh that was shared; None where one master has all.
    """

    areas: tuple[Polygon, ...]
    imbalance: float = 0.0
    dropped: tuple[DroppedPart, ...] = ()
    warnings: tuple[str, ...] = ()
    partition: Partition | None = None


def shared(
    free: Polygon, masters: Sequence[Vehicle], footprint_m: float | None = None, water: Polygon | None = None
) -> Sharing:
    """Share the free space in proportion to what each master can cover: the range that its ways leave.

    By antagonising wavefronts over a mesh, balanced (Balampanis, Maza and Ollero 2016, Algorithm 1 and section
    VIII); see `balanced_partition`. Starts may coincide or lie ashore: waves begin in the nearest triangle.

    Parameters
    ----------
    free
        What is shared.
    masters
        One or more.
    footprint_m
        The longest edge of the mesh; by default such that a share has about `TRIANGLES` triangles.
    water
        What legs to and from the free space may cross; absent: the free space alone.

    Raises
    ------
    InvalidMission
        There is no master, or the footprint is so small that meshing would take minutes.
    Infeasible
        A master cannot reach any of the free space and be home within its range.
    """
    if not masters:
        raise InvalidMission("has no master; expected one or more to share the free space", where="vehicles")
    if len(masters) == 1:
        return Sharing((free,))
    mesh = mesh_area(free, _footprint_m(free, len(masters), footprint_m))
    reach = Reach.of(mesh, masters, free, water)
    within = _within_reach(mesh, reach)
    reach = reach.among(within)
    docks: list[Place] = [(x, y) for x, y in reach.docks.tolist()]
    partition = balanced_partition(mesh.part(within), docks, reach.lengths_m - reach.legs_m, reach.allowed)
    reach = reach.on(partition.mesh)
    partition = _by_length_left(partition, reach)
    own = _own(partition, reach)
    uneven = _imbalance(partition, reach)
    return Sharing(
        areas=tuple(partition.mesh.region(triangles) for triangles in own),
        imbalance=uneven,
        dropped=(
            *_dropped(mesh, within, TOO_FAR),
            *_dropped(partition.mesh, np.logical_or.reduce(own), BOXED_IN),
        ),
        warnings=(_uneven(partition, reach, masters),) if uneven > BALANCE else (),
        partition=partition,
    )


def _footprint_m(free: Polygon, masters: int, footprint_m: float | None) -> float:
    if footprint_m is None:
        return _edge_m(free, TRIANGLES * masters)
    if footprint_m < (least_m := _edge_m(free, MOST_TRIANGLES)):
        raise InvalidMission(f"is {footprint_m:g} m; expected {least_m:.3g} m or more", where="footprint_m")
    return footprint_m


def _edge_m(area: Polygon, triangles: int) -> float:
    """The edge of equilateral triangles of which so many have the area, or, where it is thin, line its rim."""
    return max(math.sqrt(4.0 / math.sqrt(3.0) * area.area / triangles), area.length / triangles)


def _within_reach(mesh: Mesh, reach: Reach) -> Mask:
    """The triangles that some vehicle can see and be home, shape (m,): where they hang together with its start."""
    first = np.argmin(reach.out_m + reach.home_m, axis=1)
    return propagate(mesh, first, np.logical_or.reduce(reach.allowed)).source >= 0


def _by_length_left(partition: Partition, reach: Reach) -> Partition:
    """Shares balanced by what the ways to them leave: within `SETTLED`, or as well as was found."""
    best, least = partition, _badness(partition, reach)
    for _ in range(ROUNDS):
        if _imbalance(partition, reach) <= SETTLED:
            return partition
        partition = rebalanced(partition, reach.left_m(partition.share), reach.allowed)
        if (badness := _badness(partition, reach)) < least:
            best, least = partition, badness
    return best


def _badness(partition: Partition, reach: Reach) -> float:
    """What stands for the greatest spacing of shares."""
    return float((partition.areas_m2 * _spacings_m(partition, reach) ** SPACING_POWER).sum())


def _spacings_m(partition: Partition, reach: Reach) -> FloatArray:
    """What every vehicle leaves between its legs, about, shape (k,): the area of its share for the length left."""
    return np.asarray(partition.areas_m2 / reach.left_m(partition.share))


def _imbalance(partition: Partition, reach: Reach) -> float:
    """The greatest deviation of a share's area from what the lengths left ask for, as a share of that."""
    due_m2 = due_areas_m2(partition.mesh, partition.share, reach.left_m(partition.share))
    return imbalance(partition.areas_m2, due_m2)


def _own(partition: Partition, reach: Reach) -> Mask:
    """The triangles that each vehicle surveys, shape (k, m): connected, within its reach."""
    own = [largest_piece(partition.mesh, each & (partition.share == k)) for k, each in enumerate(reach.allowed)]
    return np.array(own)


def _dropped(mesh: Mesh, kept: Mask, reason: str) -> Iterator[DroppedPart]:
    """All triangles but some as water that is left out, the largest part first."""
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
    """Which shares differ most, and what would help."""
    spacings_m = _spacings_m(partition, reach)
    dense, sparse = (masters[int(which)].name for which in (spacings_m.argmin(), spacings_m.argmax()))
    return (
        f"shares are not even: {dense} can leave {spacings_m.min():.3g} m between its legs, {sparse}"
        f" {spacings_m.max():.3g} m, for the ways there take the length: start vehicles apart, or give more length"
    )
