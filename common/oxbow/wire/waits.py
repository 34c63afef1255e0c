"""Seconds that come from outside and become a wait: finite, and within what clocks and operating systems take."""

from __future__ import annotations

from oxbow.errors import InvalidMission

__all__ = ["MOST_WAIT_S", "checked_wait"]

MOST_WAIT_S = 7 * 86_400.0
"""The longest wait for anything: `poll` takes no more than 24 days, and clocks that differ by hours do no harm."""


def checked_wait(seconds: float, where: str) -> float:
    """`seconds`, if one may wait so long; `InvalidMission` where it is no number from 0 to `MOST_WAIT_S`."""
    if not 0.0 <= seconds <= MOST_WAIT_S:
        raise InvalidMission(f"is {seconds!r} s; expected 0 to {MOST_WAIT_S:g} s", where=where)
    return seconds
