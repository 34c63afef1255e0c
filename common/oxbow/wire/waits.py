"""Waits that come from outside: finite, and within what clocks and operating systems accept."""

from __future__ import annotations

from oxbow.errors import InvalidOption

__all__ = ["MOST_WAIT_S", "checked_wait"]

MOST_WAIT_S = 7 * 86_400.0
"""The longest wait for anything: `poll` takes no more than 24 days, and clocks that differ by hours do no harm."""


def checked_wait(seconds: float, where: str) -> float:
    """`seconds`, if that is how long one may wait.

    Parameters
    ----------
    seconds
        How long to wait.
    where
        The field that it comes from, for the error.

    Returns
    -------
    float
        `seconds`, unchanged.

    Raises
    ------
    InvalidOption
        It is not a number from 0 to `MOST_WAIT_S`.
    """
    # Negated, so that NaN is refused.
    if not 0.0 <= seconds <= MOST_WAIT_S:
        raise InvalidOption(f"is {seconds!r} s; expected 0 to {MOST_WAIT_S:g} s", where=where)
    return seconds
