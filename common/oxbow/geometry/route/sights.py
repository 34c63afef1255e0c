"""Lines of sight across the water, by triangular expansion.

F. Bungiu, M. Hemmer, J. Hershberger, K. Huang and A. Kroeller (2014), *Efficient computation of visibility
polygons*: a cone of view enters a triangle through one side, is split by the opposite corner, and leaves through
the other two sides. In this module the cones of all eyes advance together, one triangle per step, as arrays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oxbow.arrays import FloatArray, Indices, Mask
from oxbow.geometry.route.mesh import Touches, WaterMesh
from oxbow.geometry.triangles import cross, following

__all__ = ["IN_LINE", "Sights", "sights"]


IN_LINE = 1e-12
"""Sine of the angle below which two directions are one: three thousand times what rounding makes of it."""


@dataclass(frozen=True)
class Sights:
    """What eyes see: pairs of an eye and a corner of the mesh, and pairs of an eye and a place."""

    corner_eyes: Indices
    corners: Indices
    place_eyes: Indices
    places: Indices


@dataclass(frozen=True)
class _Cones:
    """Cones of view that enter triangles: the eye, the side entered, the limits of view as seen from the eye."""

    eye: Indices
    side: Indices
    right: FloatArray
    left: FloatArray

    def __getitem__(self, chosen: Mask | Indices) -> _Cones:
        return _Cones(self.eye[chosen], self.side[chosen], self.right[chosen], self.left[chosen])


def sights(
    mesh: WaterMesh, eyes: FloatArray, at: Touches, places: FloatArray, sought: Touches, wanted: Mask
) -> Sights:
    """What each eye sees of the corners and of some places.

    Parameters
    ----------
    mesh
        The water.
    eyes : ndarray, shape (k, 2)
        Where they are, in metres.
    at
        The triangles that the eyes look out of.
    places : ndarray, shape (p, 2)
        What is sought besides corners, in metres.
    sought
        The triangles that these places touch.
    wanted : ndarray of bool, shape (3 n,)
        The corners that count.

    Returns
    -------
    Sights
        Pairs may occur more than once.
    """
    # Sorted by triangle, so that a cone finds the places in its triangle by bisection.
    by_triangle = np.argsort(sought.triangle, kind="stable")
    held = Touches(sought.place[by_triangle], sought.triangle[by_triangle])
    # An eye sees all of the triangles that it touches; beyond them, what its cones reach.
    found_corners = [_counted(*at.sides(), wanted)]
    eye_at, place = _held(at.triangle, held)
    found_places = [(at.place[eye_at], place)]
    cones = _first_cones(mesh, eyes, at)
    # Ends: no straight line enters a triangle twice, so that no cone takes more steps than there are triangles.
    while len(cones.eye):
        apex = mesh.tails[following(following(cones.side))] - eyes[cones.eye]
        seen = _is_in(cones, apex)
        found_corners.append(_counted(cones.eye[seen], following(following(cones.side[seen])), wanted))
        found_places.append(_places_in(cones, eyes, places, held))
        cones = _parted(mesh, cones, apex)
    corner_eyes, corners = map(np.concatenate, zip(*found_corners, strict=True))
    place_eyes, seen_places = map(np.concatenate, zip(*found_places, strict=True))
    return Sights(corner_eyes, corners, place_eyes, seen_places)


def _counted(eye: Indices, corner: Indices, wanted: Mask) -> tuple[Indices, Indices]:
    return eye[wanted[corner]], corner[wanted[corner]]


def _first_cones(mesh: WaterMesh, eyes: FloatArray, at: Touches) -> _Cones:
    """From each triangle that an eye looks out of, through the sides that it does not lie on."""
    eye, side = at.sides()
    right, left = mesh.tails[side] - eyes[eye], mesh.heads[side] - eyes[eye]
    # A side that the eye lies on, or in line with, has no width as seen from there.
    through = _is_left(left, of=right) & (mesh.twins[side] >= 0)
    return _Cones(eye[through], mesh.twins[side[through]], right[through], left[through])


def _parted(mesh: WaterMesh, cones: _Cones, apex: FloatArray) -> _Cones:
    """The cones beyond the triangles entered; they split at the opposite corner, `apex` as seen from the eye."""
    to_right, to_left = following(cones.side), following(following(cones.side))
    # The apex left of the cone sends all of it through the right side, and the other way round; else it splits.
    below_left, above_right = _is_left(cones.left, of=apex), _is_left(apex, of=cones.right)
    pass_right = above_right & (mesh.twins[to_right] >= 0)
    pass_left = below_left & (mesh.twins[to_left] >= 0)
    left = np.where(below_left[:, None], apex, cones.left)
    right = np.where(above_right[:, None], apex, cones.right)
    return _Cones(
        np.concatenate([cones.eye[pass_right], cones.eye[pass_left]]),
        np.concatenate([mesh.twins[to_right[pass_right]], mesh.twins[to_left[pass_left]]]),
        np.concatenate([cones.right[pass_right], right[pass_left]]),
        np.concatenate([left[pass_right], cones.left[pass_left]]),
    )


def _places_in(cones: _Cones, eyes: FloatArray, places: FloatArray, held: Touches) -> tuple[Indices, Indices]:
    """Eyes and the places that they see in the triangles that their cones have entered."""
    cone, place = _held(cones.side // 3, held)
    cones = cones[cone]
    seen = _is_in(cones, places[place] - eyes[cones.eye])
    return cones.eye[seen], place[seen]


def _held(triangles: Indices, held: Touches) -> tuple[Indices, Indices]:
    """Pairs of an index into `triangles` and a place held by that triangle; `held` is sorted by triangle."""
    first = np.searchsorted(held.triangle, triangles)
    count = np.searchsorted(held.triangle, triangles, side="right") - first
    owner = np.repeat(np.arange(len(triangles)), count)
    rank = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    return owner, held.place[first[owner] + rank]


def _is_in(cones: _Cones, directions: FloatArray) -> Mask:
    """Whether directions lie within cones, limits included."""
    return ~_is_left(directions, of=cones.left) & ~_is_left(cones.right, of=directions)


def _is_left(a: FloatArray, *, of: FloatArray) -> Mask:
    """Whether directions lie to the left of others, by more than rounding."""
    # Relative to both lengths, so that the slack is an angle, however far the directions reach.
    slack = IN_LINE * np.hypot(a[:, 0], a[:, 1]) * np.hypot(of[:, 0], of[:, 1])
    return np.asarray(cross(of, a) > slack)
