"""What solves the travelling salesman problem on geodesic distances."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from oxbow.arrays import Indices
from oxbow_path.tour.start import Start

__all__ = ["Solver", "TourSolution"]


@dataclass(frozen=True)
class TourSolution:
    """A closed tour: every site once, in this order; and what found it."""

    order: Indices
    solver: str


class Solver(Protocol):
    """Shortens a closed tour; the same start and seed give the same tour."""

    def __call__(self, start: Start, *, seed: int) -> TourSolution:
        """Shorten `start`, by legs between near sites alone."""
        ...
