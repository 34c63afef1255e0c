"""The revisions of missions, and what is asked for each."""

from __future__ import annotations

from dataclasses import dataclass

from oxbow.contracts import MissionStatus

__all__ = ["QueuedMission", "Request", "Revision"]


@dataclass(frozen=True)
class Request:
    """What is asked for one mission, in JSON; requests with the same `fingerprint` ask for the same plan."""

    document: bytes
    parameters: bytes
    fingerprint: str


@dataclass(frozen=True)
class Revision:
    """Which revision of which mission; `number` counts from 1."""

    mission_id: str
    number: int

    @classmethod
    def of(cls, status: MissionStatus) -> Revision:
        return cls(status.mission_id, status.revision)

    def __str__(self) -> str:
        return f"mission {self.mission_id}, revision {self.number}"


@dataclass(frozen=True)
class QueuedMission:
    """A revision claimed for planning, and whose it is."""

    revision: Revision
    request: Request
    client: str = ""
