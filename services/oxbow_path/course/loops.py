"""Loops round islands, along the middle of the water between shores.

A walk round a tree goes along both sides of the tree's lines, so that the water round an island is passed twice:
out and back. Where that water is hardly wider than a spacing, once round serves it as well, in half the length
(Rendas and Li 2016, end of section 1.2.1.2, ask for circular motions around islands).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components
from shapely import LinearRing

from oxbow.arrays import FloatArray, Indices, Mask
from oxbow.geometry.route.mesh import WaterMesh
from oxbow_path.walk.region import largest

__all__ = ["Middles"]

NARROW = 2.5
"""Water no wider than this, in spacings, is served by passing it once."""

LEAST_SHARE = 0.5
"""A loop of which less than this share is narrow is not worth trying."""


@dataclass(frozen=True)
class Middles:
    """The lines midway between shores, in pieces: each has the shores on its two sides, and the width there.

    Parameters
    ----------
    pieces : ndarray, shape (n, 2, 2)
        From one middle of a gate to the next, in metres.
    shores : ndarray of int, shape (n, 2)
        The numbers of the shores on either side; `exterior` is that of the outer one.
    width_m : ndarray, shape (n,)
        The mean length of the two gates.
    """

    pieces: FloatArray
    shores: Indices
    width_m: FloatArray
    exterior: int

    @classmethod
    def of(cls, mesh: WaterMesh) -> Middles:
        """The middles of a triangulated water: triangles with corners on two shores or three."""
        shore = _shore_of_points(mesh)
        tail = shore[mesh.triangles]
        head = np.roll(tail, -1, axis=1)
        is_gate = tail != head
        middle = ((mesh.tails + mesh.heads) / 2).reshape(-1, 3, 2)
        width_m = np.hypot(*(mesh.heads - mesh.tails).T).reshape(-1, 3)
        # A gate is a side between two shores. A triangle with two is passed from one to the other, one with three
        # is where three waters meet; one with all its corners on one shore has no middle.
        two, three = np.flatnonzero(is_gate.sum(axis=1) == 2), np.flatnonzero(is_gate.sum(axis=1) == 3)
        first = np.argmax(is_gate[two], axis=1)
        last = 2 - np.argmax(is_gate[two, ::-1], axis=1)
        star = np.repeat(three, 3), np.tile(np.arange(3), len(three))
        centre = middle[star[0]].mean(axis=1)
        pieces = np.concatenate(
            [np.stack([middle[two, first], middle[two, last]], axis=1), np.stack([middle[star], centre], axis=1)]
        )
        shores = np.concatenate(
            [np.column_stack([tail[two, first], head[two, first]]), np.column_stack([tail[star], head[star]])]
        )
        widths = np.concatenate([(width_m[two, first] + width_m[two, last]) / 2, width_m[star]])
        return cls(pieces, np.sort(shores, axis=1), widths, int(shore[np.argmin(mesh.points[:, 0])]))

    def loops(self, spacing_m: float, most_m: float) -> tuple[LinearRing, ...]:
        """Loops most of whose way is narrow: round one island, and round several.

        Parameters
        ----------
        spacing_m
            What narrow is measured against.
        most_m
            How long a loop may be.

        Returns
        -------
        tuple of LinearRing
            At most two, in metres; none where no island has narrow water round it.
        """
        sets = list(self._growing(spacing_m, most_m))
        loops = [self._loop(inside) for inside in [*sets[:1], *sets[1:][-1:]]]
        return tuple(loop for loop in loops if loop is not None and loop.length <= most_m)

    def _growing(self, spacing_m: float, most_m: float) -> Iterator[Mask]:
        """Islands to go round: first that with the longest narrow way, then others too, while that way grows."""
        length_m = np.hypot(*(self.pieces[:, 1] - self.pieces[:, 0]).T)
        between = self._between(length_m)
        narrow = self._between(length_m * (self.width_m <= NARROW * spacing_m))
        inside = np.zeros(between.shape[0], dtype=bool)
        total_m = narrow_m = 0.0
        while True:
            # The way round one more island is that round it, less what lies between it and those inside.
            totals_m, narrows_m = (
                so_far_m + ways.sum(axis=1) - 2.0 * (ways @ inside)
                for so_far_m, ways in ((total_m, between), (narrow_m, narrow))
            )
            possible = ~inside & (totals_m <= most_m) & (narrows_m >= LEAST_SHARE * totals_m)
            # The outer shore cannot be gone round inside the water.
            possible[self.exterior] = False
            best = int(np.argmax(np.where(possible, narrows_m, 0.0)))
            if not possible[best] or narrows_m[best] <= narrow_m:
                return
            # A copy, since the set before was yielded and is kept by the caller.
            inside = inside.copy()
            inside[best] = True
            total_m, narrow_m = float(totals_m[best]), float(narrows_m[best])
            yield inside

    def _between(self, length_m: FloatArray) -> csr_array[np.float64]:
        """The length of the pieces between any two shores, symmetric."""
        count = max(int(self.shores.max(initial=0)), self.exterior) + 1
        both = np.concatenate([self.shores, self.shores[:, ::-1]]).T
        return csr_array(coo_array((np.tile(length_m, 2), (both[0], both[1])), shape=(count, count)))

    def _loop(self, inside: Mask) -> LinearRing | None:
        """The outer ring of the pieces round some islands; None where they do not close."""
        held = inside[self.shores]
        pieces = np.asarray(shapely.linestrings(self.pieces[held[:, 0] != held[:, 1]]))
        faces = shapely.union_all(shapely.get_parts(shapely.polygonize(pieces)))
        return None if faces.is_empty else largest(faces).exterior


def _shore_of_points(mesh: WaterMesh) -> Indices:
    """The number of the shore that each vertex lies on, shape (n,): the shores' sides join their vertices."""
    corners = mesh.triangles.ravel()
    heads = np.roll(mesh.triangles, -1, axis=1).ravel()
    sides, count = mesh.shore, len(mesh.points)
    joined = coo_array((np.ones(len(sides)), (corners[sides], heads[sides])), shape=(count, count))
    return np.asarray(connected_components(joined, directed=False)[1], dtype=np.intp)
