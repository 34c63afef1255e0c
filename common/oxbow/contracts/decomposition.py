"""Stage `decomposition`: from free space to cells."""

from __future__ import annotations

import enum
import math

import numpy as np
from shapely import Polygon

from oxbow.arrays import FloatArray, Place
from oxbow.contracts.message import MOST_LENGTH_M, Message, require_area, require_finite, require_place
from oxbow.errors import InvalidRequest
from oxbow.tolerances import FARTHEST_M, ROUNDING_M

__all__ = ["Cell", "CriticalKind", "CriticalPoint", "DecomposeRequest", "Decomposition", "HeadingScore"]


class CriticalKind(enum.StrEnum):
    """What happens to the sweep line's cells at a critical point."""

    OPEN = "open"
    CLOSE = "close"
    SPLIT = "split"
    MERGE = "merge"


class CriticalPoint(Message, frozen=True, kw_only=True):
    """A vertex at which the number of cells on the sweep line changes; `place` is planar."""

    kind: CriticalKind
    place: Place

    def __post_init__(self) -> None:
        require_place(self, "place")


class Cell(Message, frozen=True, kw_only=True):
    """A region between a floor and a ceiling, met by every transect line in one interval.

    `floor` and `ceiling` are float arrays of shape (n, 2) in the *sweep frame* of the decomposition
    (u across the transects, v along them), both with non-decreasing u, and with equal first and equal
    last u. `start` and `end` are indices of the critical points at which the cell begins and ends.
    """

    floor: FloatArray
    ceiling: FloatArray
    start: int
    end: int

    def __post_init__(self) -> None:
        for field in ("floor", "ceiling"):
            chain = getattr(self, field)
            if chain.ndim != 2 or chain.shape[1] != 2 or len(chain) < 1 or (np.diff(chain[:, 0]) < 0).any():
                raise InvalidRequest("is not an (n, 2) chain with non-decreasing u", where=field)
            # As `<=`, since NaN compares false and would pass a test for `>`.
            if not (np.abs(chain) <= FARTHEST_M).all():
                message = f"has coordinates that are not finite, or beyond {FARTHEST_M:g} m"
                raise InvalidRequest(message, where=field)
        # Exactly: both chains come from one sweep, which takes their ends from the same critical points.
        if (self.floor[[0, -1], 0] != self.ceiling[[0, -1], 0]).any():
            raise InvalidRequest("begins or ends at another u than the floor", where="ceiling")


class HeadingScore(Message, frozen=True, kw_only=True):
    """The predicted cost of one heading: metres of path per square metre of water, less is better."""

    heading_rad: float
    predicted_cost: float

    def __post_init__(self) -> None:
        require_finite(self, "heading_rad", "predicted_cost")


class DecomposeRequest(Message, frozen=True, kw_only=True):
    """Free space to cut into cells; the best of several headings where `heading_rad` is absent."""

    free: Polygon
    spacing_m: float
    heading_rad: float | None = None

    def __post_init__(self) -> None:
        require_area(self, "free")
        require_finite(self, "spacing_m", above=0.0, most=MOST_LENGTH_M)
        require_finite(self, "heading_rad")


class Decomposition(Message, frozen=True, kw_only=True):
    """Cells that tile the free space, and the critical points between them: the Reeb graph.

    Transects run along `heading_rad` (clockwise from north). Sweep frame and planar frame differ by a
    rotation: u = x cos h - y sin h, v = x sin h + y cos h. The Reeb graph's nodes are the critical points,
    its edges the cells (`start` -> `end`).
    """

    heading_rad: float
    cells: tuple[Cell, ...]
    critical_points: tuple[CriticalPoint, ...]
    scores: tuple[HeadingScore, ...] = ()

    def __post_init__(self) -> None:
        require_finite(self, "heading_rad")
        most = len(self.critical_points)
        for number, cell in enumerate(self.cells):
            if not (0 <= cell.start < most and 0 <= cell.end < most):
                raise InvalidRequest(
                    f"joins the critical points {cell.start} and {cell.end}; there are {most}",
                    where=f"cells[{number}]",
                )
        self._require_ends()

    def _require_ends(self) -> None:
        """Check that each cell begins and ends at its critical points: others are of another heading or water."""
        if not self.cells:
            return
        x, y = np.array([point.place for point in self.critical_points]).T
        u = x * math.cos(self.heading_rad) - y * math.sin(self.heading_rad)
        points = u[[(cell.start, cell.end) for cell in self.cells]]
        ends = np.array([(cell.floor[0, 0], cell.floor[-1, 0]) for cell in self.cells])
        off_m = np.abs(points - ends).max(axis=1)
        if off_m.max() > ROUNDING_M:
            worst = int(off_m.argmax())
            raise InvalidRequest(
                f"begins or ends {off_m[worst]:g} m from its critical points", where=f"cells[{worst}]"
            )
