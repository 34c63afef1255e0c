"""Stretches of a path.

Arguments that are called `stretches` are where each begins and ends, in metres along the path, shape (n, 2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely import LineString

from oxbow.arrays import FloatArray, Geometries, Indices
from oxbow.tolerances import ROUNDING_M

__all__ = ["PathSegments", "clipped_stretches", "covered_m", "gaps_between", "merged_stretches"]


@dataclass(frozen=True)
class PathSegments:
    """A path's segments: `lines` (n,), their ends (n, 2, 2), and how far along the path each begins, (n,)."""

    lines: Geometries
    ends: FloatArray
    start_m: FloatArray
    length_m: float

    @classmethod
    def of(cls, path: LineString) -> PathSegments:
        """The segments of a path that have a length."""
        xy = shapely.get_coordinates(path)
        ends = np.stack([xy[:-1], xy[1:]], axis=1)
        # A repeated point makes a segment without a direction, by whose length `at` would divide.
        ends = ends[(ends[:, 0] != ends[:, 1]).any(axis=1)]
        length_m = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
        end_m = np.cumsum(length_m)
        return cls(np.asarray(shapely.linestrings(ends)), ends, end_m - length_m, float(end_m[-1]))

    def at(self, along_m: FloatArray) -> FloatArray:
        """Places (n, 2) at distances along the path."""
        segment = np.clip(np.searchsorted(self.start_m, along_m, side="right") - 1, 0, None)
        start, end = self.ends[segment].transpose(1, 0, 2)
        step = end - start
        # Not clipped: rounding may lead a hair beyond a segment's end, which is as good a place.
        share = (along_m - self.start_m[segment]) / np.hypot(*step.T)
        return np.asarray(start + share[:, None] * step)

    def stretches(self, parts: Geometries, segment: Indices) -> FloatArray:
        """Where along the path parts of its segments begin and end, shape (n, 2); points have no stretch.

        Parameters
        ----------
        parts
            Lines on segments, shape (k,); anything else is left out.
        segment
            The segment that each lies on, shape (k,).

        Returns
        -------
        ndarray, shape (k, 2)
            In metres along the path, in the order of the parts; empty where all parts are points.
        """
        lines = shapely.get_type_id(parts) == shapely.GeometryType.LINESTRING
        lines &= ~shapely.is_empty(parts)
        parts, segment = parts[lines], segment[lines]
        ends = np.stack([shapely.get_coordinates(shapely.get_point(parts, at)) for at in (0, -1)], axis=1)
        along = np.hypot(*(ends - self.ends[segment, :1]).transpose(2, 0, 1)) + self.start_m[segment, None]
        # An overlay may return a part in either direction.
        return np.asarray(np.sort(along, axis=1))


def merged_stretches(stretches: FloatArray) -> FloatArray:
    """The same stretches in order, with those that meet, but for rounding, joined."""
    if len(stretches) == 0:
        return stretches
    stretches = stretches[np.argsort(stretches[:, 0], kind="stable")]
    # A stretch may lie inside an earlier one: what counts is the farthest end so far.
    reach = np.maximum.accumulate(stretches[:, 1])
    # Parts of two segments that share a vertex may end a rounding error apart: that gap is no part of the path.
    first = np.flatnonzero(np.concatenate([[True], stretches[1:, 0] > reach[:-1] + ROUNDING_M]))
    return np.column_stack([stretches[first, 0], reach[np.append(first[1:] - 1, len(reach) - 1)]])


def gaps_between(stretches: FloatArray, total_m: float) -> FloatArray:
    """The stretches of a path that others leave.

    Parameters
    ----------
    stretches
        In order, none meeting another (`merged_stretches`).
    total_m
        The length of the path.

    Returns
    -------
    ndarray, shape (k, 2)
        In order, and none of them empty.
    """
    rest = np.column_stack([np.append(0.0, stretches[:, 1]), np.append(stretches[:, 0], total_m)])
    return np.asarray(rest[rest[:, 1] > rest[:, 0]])


def clipped_stretches(stretches: FloatArray, start_m: float, end_m: float) -> FloatArray:
    """The parts of stretches that lie within another.

    Parameters
    ----------
    stretches
        In any order.
    start_m, end_m
        Where that one begins and ends, in metres along the path; nothing lies within where it ends first.

    Returns
    -------
    ndarray, shape (k, 2)
        In the order given; those that lie outside altogether are left out.
    """
    cut = np.clip(stretches, start_m, max(start_m, end_m))
    return np.asarray(cut[cut[:, 1] > cut[:, 0]])


def covered_m(stretches: FloatArray) -> float:
    """The length of stretches in all, in metres; what several cover counts several times."""
    return float((stretches[:, 1] - stretches[:, 0]).sum())
