"""What travels beside a request: whose it is, and until when an answer is of use."""

from __future__ import annotations

import time

import msgspec

__all__ = ["Envelope"]


class Envelope(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The attachment of a query to a stage (JSON).

    Parameters
    ----------
    request_id
        One for each request; a retry keeps it, so that a stage may answer twice but need not work twice.
    deadline_s
        Unix time after which nobody waits for the answer.
    mission_id
        The mission that the request belongs to; without one, the stage shows no layers.
    run_id
        The run of that mission: its requests and their layers share it.
    origin
        Latitude and longitude (degrees, WGS84) of the origin of the mission's planar frame.
    part
        The vehicle or the role that the request is about, where a mission has several: its layers are told apart.
    """

    request_id: str
    deadline_s: float
    mission_id: str = ""
    run_id: str = ""
    origin: tuple[float, float] | None = None
    part: str = ""

    def remaining_s(self) -> float:
        """Seconds until the deadline; negative once it has passed."""
        return self.deadline_s - time.time()
