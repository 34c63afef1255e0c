"""Wavefronts over a mesh: which one reaches a triangle first, and in how many steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from oxbow.arrays import Indices, Mask
from oxbow_assignment.shares.mesh.mesh import Mesh

__all__ = ["Wavefront", "propagate"]

UNREACHED = -1


@dataclass(frozen=True)
class Wavefront:
    """What the wavefronts leave on every triangle.

    Parameters
    ----------
    source : ndarray of int, shape (m,)
        Which start reached the triangle first, as an index into the starts; -1 where none did.
    depth : ndarray of int, shape (m,)
        Steps from that start, 0 on the start itself; -1 where none reached.
    branch : ndarray of int, shape (m,)
        Through which side of the start's triangle the wave came, ``3 * source + side``; -1 on starts.
    """

    source: Indices
    depth: Indices
    branch: Indices


def propagate(mesh: Mesh, starts: Sequence[int] | Indices, within: Mask | None = None) -> Wavefront:
    """Let antagonising wavefronts run from some triangles (Balampanis, Maza and Ollero 2016, Algorithm 1).

    In every step each wave takes the free neighbours of what it took in the step before. Where two waves reach a
    triangle in the same step, the one that comes from the triangle of lower index takes it. Depths begin at 0; in
    the paper at 1.

    Parameters
    ----------
    mesh
        The mesh.
    starts
        Numbers of triangles, one per wave; of several waves on one triangle, the first has it.
    within
        The triangles that waves may enter, shape (m,); all by default.

    Returns
    -------
    Wavefront
        Unreached are triangles outside `within`, and those that it cuts off.
    """
    free = np.ones(len(mesh), dtype=bool) if within is None else within.copy()
    source, depth, branch = (np.full(len(mesh), UNREACHED, dtype=np.intp) for _ in range(3))
    front, first = np.unique(np.asarray(starts, dtype=np.intp), return_index=True)
    source[front], depth[front], free[front] = first, 0, False
    step = 0
    while len(front):
        step += 1
        reached = mesh.neighbours[front].ravel()
        by = np.repeat(front, 3)
        opens = np.flatnonzero((reached >= 0) & free[reached])
        # The front is sorted, and `unique` finds first occurrences: the parent of lowest index wins.
        following, at = np.unique(reached[opens], return_index=True)
        parent = by[opens[at]]
        source[following], depth[following], free[following] = source[parent], step, False
        branch[following] = branch[parent] if step > 1 else 3 * source[parent] + opens[at] % 3
        front = following
    return Wavefront(source, depth, branch)
