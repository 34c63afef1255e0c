"""What is due to every share: in proportion to capacities, as far as each vehicle's reach has room for it."""

from __future__ import annotations

import numpy as np

from oxbow.arrays import FloatArray, Indices, Mask
from oxbow_assignment.shares.mesh import Mesh

__all__ = ["attainable_areas_m2", "due_areas_m2"]


def due_areas_m2(mesh: Mesh, share: Indices, capacities: FloatArray) -> FloatArray:
    """The area due to every share in proportion to capacities, in m2, shape (k,).

    Each connected piece of the mesh is shared among the vehicles that have a share in it.

    Parameters
    ----------
    mesh
        The mesh.
    share
        The vehicle of every triangle, 0 to k - 1, shape (m,); every share lies in one piece of the mesh.
    capacities
        What each vehicle can cover, in any unit, shape (k,).

    Returns
    -------
    ndarray of float, shape (k,)
        They add up to the area of the mesh.
    """
    piece = mesh.pieces[np.unique(share, return_index=True)[1]]
    areas_m2 = np.bincount(mesh.pieces, mesh.areas_m2)
    return np.asarray(areas_m2[piece] * capacities / np.bincount(piece, capacities)[piece])


def attainable_areas_m2(mesh: Mesh, share: Indices, capacities: FloatArray, allowed: Mask) -> FloatArray:
    """What is due to every share where vehicles of short reach cannot have what is due to them.

    All that they reach together is shared among these alone, in proportion to their capacities. What is left is
    shared among the others: else who is nearest to them keeps what they cannot take, instead of passing it on.

    Parameters
    ----------
    mesh, share, capacities
        As for `due_areas_m2`.
    allowed
        Which triangles each vehicle may have, shape (k, m).

    Returns
    -------
    ndarray of float, shape (k,)
        They add up to the area of the mesh.
    """
    due_m2 = due_areas_m2(mesh, share, capacities)
    if allowed.all():
        return due_m2
    piece = mesh.pieces[np.unique(share, return_index=True)[1]]
    for number in np.unique(piece):
        own, here = np.flatnonzero(piece == number), mesh.pieces == number
        within_m2 = _within_reach_m2(capacities[own], allowed[own] & here, mesh.areas_m2)
        # What none of them reaches is theirs all the same, until it is dropped.
        due_m2[own] = within_m2 * (due_m2[own].sum() / within_m2.sum())
    return due_m2


def _within_reach_m2(capacities: FloatArray, allowed: Mask, areas_m2: FloatArray) -> FloatArray:
    """Areas, shape (k,), in proportion to capacities among vehicles that have as little room for theirs."""
    # Those of least reach first: from one start, what they reach lies within what the others reach.
    order = np.argsort(allowed @ areas_m2, kind="stable")
    reached_m2 = np.logical_or.accumulate(allowed[order]) @ areas_m2
    asked = np.cumsum(capacities[order])
    within_m2 = np.empty(len(order))
    taken_m2, given, first = 0.0, 0.0, 0
    while first < len(order):
        room = (reached_m2[first:] - taken_m2) / (asked[first:] - given)
        # As many as have the least room together: the last of equals, so that nobody is left with none.
        tight = first + len(room) - int(np.argmin(room[::-1]))
        group = order[first:tight]
        within_m2[group] = capacities[group] * room[tight - 1 - first]
        taken_m2, given, first = float(reached_m2[tight - 1]), float(asked[tight - 1]), tight
    return within_m2
