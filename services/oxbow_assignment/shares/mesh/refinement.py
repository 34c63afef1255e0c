"""Refinement: points are added where edges are too long or angles too small."""

from __future__ import annotations

import numpy as np

from oxbow.arrays import Indices
from oxbow_assignment.shares.mesh.triangulation import Triangulation

__all__ = ["refined"]

FINEST = 1 / 16
"""No edge is halved below this fraction of `edge_m`, so that refinement ends, however narrow the water."""

MAX_ROUNDS = 200

SIZE_TOLERANCE = 1e-9


def refined(mesh: Triangulation, edge_m: float, least_angle_rad: float) -> Triangulation:
    """Refine until no edge is longer than `edge_m`, and no angle less than the bound, except at the shortest.

    From every bad triangle the longest edges lead to one that is the longest of both its triangles, or lies on the
    border (Rivara 1997). A point is added there: at the centroid of the two triangles (Rivara and Calderon 2010),
    or in the middle of the border's edge.

    Parameters
    ----------
    mesh
        What to refine.
    edge_m
        The longest edge.
    least_angle_rad
        Triangles with a smaller angle are refined; 0 for none.

    Returns
    -------
    Triangulation
        Tiles the same area.
    """
    for _ in range(MAX_ROUNDS):
        lengths = mesh.side_lengths
        too_long = lengths.max(axis=1) > edge_m * (1 + SIZE_TOLERANCE)
        bad = too_long | (mesh.least_sines < np.sin(least_angle_rad))
        terminal = np.unique(_terminal_sides(mesh)[bad])
        # In narrow water, small angles are there to stay: without a floor, they would be halved for ever.
        terminal = terminal[lengths.ravel()[terminal] > 2 * FINEST * edge_m]
        if len(terminal) == 0:
            break
        mesh = _with_terminal_points(mesh, terminal)
    return mesh


def _terminal_sides(mesh: Triangulation) -> Indices:
    """For every triangle, the side where its path over longest sides ends; of a side's two numbers, the lower one.

    By pointer jumping: in each round, every triangle looks twice as far. Both triangles of a side rank it alike,
    even among sides of equal length: otherwise a path could come back to its start and never end.
    """
    numbers = np.arange(3 * len(mesh.triangles))
    edges = np.where(mesh.twins < 0, numbers, np.minimum(numbers, mesh.twins))
    order = np.lexsort((edges, mesh.side_lengths.ravel()[edges]))
    rank = np.empty_like(order)
    rank[order] = numbers
    sides = 3 * np.arange(len(mesh.triangles)) + np.argmax(rank[edges].reshape(-1, 3), axis=1)
    twins = mesh.twins[sides]
    beyond = twins // 3
    mutual = (twins < 0) | (sides[np.where(twins < 0, 0, beyond)] == twins)
    following = np.where(mutual, np.arange(len(sides)), beyond)
    while (following[following] != following).any():
        following = following[following]
    ends = sides[following]
    other = mesh.twins[ends]
    return np.asarray(np.where((other >= 0) & (other < ends), other, ends))


def _with_terminal_points(mesh: Triangulation, terminal: Indices) -> Triangulation:
    """A point is added for each terminal side: on it if it lies on the border, else amid its two triangles."""
    on_border = mesh.twins[terminal] < 0
    inner = terminal[~on_border]
    quadrilaterals = np.concatenate([inner // 3, mesh.twins[inner] // 3]).reshape(2, -1)
    areas = mesh.doubled_areas[quadrilaterals] / 2
    middles = mesh.corners[quadrilaterals].mean(axis=2)
    places = (areas[:, :, None] * middles).sum(axis=0) / areas.sum(axis=0)[:, None]
    # Only now that the inner places are known: halving border sides changes the triangles beside them.
    if on_border.any():
        mesh = mesh.with_border_points(terminal[on_border])
    return mesh.with_points(places)
