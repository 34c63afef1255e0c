"""What solves the travelling salesman problem on geodesic distances."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from oxbow.arrays import Indices
from oxbow_path.tour.start import Start

__all__ = ["Solution", "Solver"]


@dataclass(frozen=True)
class Solution:
    """A closed tour: every site once, in this order; and what found it."""

    order: Indices
    solver: str


class Solver(Protocol):
    """Shortens a closed tour; the same start and seed give the same tour."""

    def __call__(self, start: Start, *, seed: int) -> Solution:
        """Shorten `start`, by legs between near sites alone."""
        ...
