"""Dividing treatments that are too long for one sortie into parts that are not."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from shapely import LineString
from shapely.ops import substring

from oxbow.errors import Infeasible
from oxbow_assignment.treatment.fleet import Fleet
from oxbow_assignment.treatment.treatment import Treatment

__all__ = ["Division", "OutOfReach", "Part", "divide_treatments"]

LEAST_SPARE = 0.125
"""The shortest parts of one division, as a fraction of the range; far from the docks, they are divided further."""

MOST_PARTS = 500
"""More parts than this point to a mistake in a range or a swath: no fleet goes out so often."""

LEAST_PART = 0.05
"""The shortest stretch that is divided further, as a fraction of the range: for less, no sortie is worth it."""


@dataclass(frozen=True)
class Part:
    """A stretch of a treatment that one sortie can treat.

    Parameters
    ----------
    treatment
        The index of the treatment.
    spot
        The name of its hot spot.
    since, until
        Where on the treatment's line it begins and ends, as fractions of its length.
    line
        Its passes, which may be travelled from either end.
    value
        This part's fraction of the hot spot's value.
    """

    treatment: int
    spot: str
    since: float
    until: float
    line: LineString
    value: float


@dataclass(frozen=True)
class OutOfReach:
    """A stretch of a treatment that no sortie can treat.

    Parameters
    ----------
    part
        The stretch.
    slave
        The index of the slave that comes nearest to reaching it.
    access_m
        That slave's way to it and home, without the treatment.
    """

    part: Part
    slave: int
    access_m: float


@dataclass(frozen=True)
class Division:
    """Parts that at least one slave can treat in a sortie of their own, and the rest."""

    parts: tuple[Part, ...]
    out_of_reach: tuple[OutOfReach, ...]


def divide_treatments(treatments: Sequence[Treatment], fleet: Fleet) -> Division:
    """Divide treatments into parts that fit the range of a slave, as few as possible.

    A part fits if its length and the way to it and home are within range, on average over both directions. One
    that does not fit is divided evenly into as many parts as its distance asks for, and these again where needed.
    Along a line, the way there and home changes by no more than twice what is travelled. Where even that leaves
    nothing within reach, nothing is divided further. Where routes avoid danger, or are not the shortest, that
    way may change by more, so short stretches are tried as well.

    Parameters
    ----------
    treatments
        What is divided.
    fleet
        The slaves, and their ways.

    Returns
    -------
    Division
        Parts in the order of the treatments and along their lines.

    Raises
    ------
    Infeasible
        It would take hundreds of sorties.
    """
    # Whole treatments at first; what does not fit is divided, and tried again.
    pieces = [
        Part(number, treatment.spot.name, 0.0, 1.0, treatment.line, treatment.spot.value)
        for number, treatment in enumerate(treatments)
    ]
    parts: list[Part] = []
    out_of_reach: list[OutOfReach] = []
    while pieces:
        # All pieces of a round together: a table of routes costs hardly more for many places than for one.
        ways = fleet.ways([piece.line for piece in pieces], [piece.spot for piece in pieces])
        spare = fleet.lengths_m[:, None] - ways.access_m
        longer: list[Part] = []
        for piece, length_m, own in zip(pieces, ways.lengths_m.tolist(), spare.T, strict=True):
            slave = int(own.argmax())
            is_far = own[slave] + length_m < 0.0 and fleet.finds_shortest
            # It fits, can never fit, or is divided.
            if length_m <= own[slave]:
                parts.append(piece)
            elif is_far or length_m <= LEAST_PART * fleet.lengths_m[slave]:
                access_m = float(fleet.lengths_m[slave] - own[slave])
                out_of_reach.append(OutOfReach(piece, slave, access_m))
            else:
                # Far from the docks hardly any range is spare: without a floor, one division would make crumbs.
                shortest_m = max(float(own[slave]), LEAST_SPARE * float(fleet.lengths_m[slave]))
                longer += _evenly(piece, max(2, math.ceil(length_m / shortest_m)))
        pieces = longer
    if len(parts) > MOST_PARTS:
        total_m = sum(treatment.line.length for treatment in treatments)
        raise Infeasible(
            f"take {total_m / 1000:.0f} km of passes, in {len(parts)} parts that fit a sortie; expected at most"
            f" {MOST_PARTS}: a wider swath, or vehicles of longer range",
            where="hot_spots",
        )
    # Rounds have mixed them up: a short treatment fits at once, a long one after several rounds.
    parts.sort(key=lambda part: (part.treatment, part.since))
    return Division(tuple(parts), tuple(out_of_reach))


def _evenly(piece: Part, count: int) -> list[Part]:
    shares = np.linspace(0.0, 1.0, count + 1).tolist()
    return [
        Part(
            treatment=piece.treatment,
            spot=piece.spot,
            since=piece.since + since * (piece.until - piece.since),
            until=piece.since + until * (piece.until - piece.since),
            line=_stretch(piece.line, since, until),
            value=piece.value / count,
        )
        for since, until in pairwise(shares)
    ]


def _stretch(line: LineString, since: float, until: float) -> LineString:
    """The stretch of a line between two fractions of its length."""
    stretch = substring(line, since, until, normalized=True)
    assert isinstance(stretch, LineString), "stretches have a length"
    return stretch
