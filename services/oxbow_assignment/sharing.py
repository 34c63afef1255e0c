"""Sharing the free space among the masters: each surveys a connected part, as large as its range asks for."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon

from oxbow.contracts import Vehicle
from oxbow.errors import InvalidMission
from oxbow.mesh import mesh_area
from oxbow_assignment.balancing import imbalance
from oxbow_assignment.partition import Partition, balanced_partition

__all__ = ["Sharing", "shared"]

TRIANGLES = 400
"""Triangles of a share, about, where the footprint is not given."""

MOST_TRIANGLES = 200_000
"""More than these take minutes, and no share gets better by them."""


@dataclass(frozen=True)
class Sharing:
    """The free space in shares.

    Parameters
    ----------
    areas
        One connected polygon a master, in their order; together the free space.
    imbalance
        The greatest deviation of a share's area from what is due, as a share of that.
    partition
        The mesh that was shared; None where one master has all.
    """

    areas: tuple[Polygon, ...]
    imbalance: float
    partition: Partition | None


def shared(free: Polygon, masters: Sequence[Vehicle], footprint_m: float | None = None) -> Sharing:
    """Share the free space in proportion to what each master can cover: its range times its speed.

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

    Raises
    ------
    InvalidMission
        There is no master, or the footprint is so small that meshing would take minutes.
    Infeasible
        No division balanced the shares.
    """
    if not masters:
        raise InvalidMission("has no master; expected one or more to share the free space", where="vehicles")
    if len(masters) == 1:
        return Sharing((free,), 0.0, None)
    if footprint_m is None:
        footprint_m = _edge_m(free, TRIANGLES * len(masters))
    elif footprint_m < (least_m := _edge_m(free, MOST_TRIANGLES)):
        raise InvalidMission(f"is {footprint_m:g} m; expected {least_m:.3g} m or more", where="footprint_m")
    capacities = np.array([master.length_m * master.speed_mps for master in masters])
    starts = [master.start for master in masters]
    partition = balanced_partition(mesh_area(free, footprint_m), starts, capacities)
    return Sharing(
        areas=partition.regions,
        imbalance=imbalance(shapely.area(np.asarray(partition.regions)), partition.due_m2),
        partition=partition,
    )


def _edge_m(area: Polygon, triangles: int) -> float:
    """The edge of equilateral triangles of which so many have the area."""
    return math.sqrt(4.0 / math.sqrt(3.0) * area.area / triangles)
