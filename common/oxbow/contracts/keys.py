"""Key expressions: they stand here and nowhere else."""

from __future__ import annotations

import re
from dataclasses import dataclass

from oxbow.contracts.ids import checked_id, excerpt
from oxbow.errors import InvalidMission

__all__ = [
    "ANY",
    "ANY_LAYER",
    "ANY_LIVE",
    "INTROSPECTION",
    "PLAN_KEY",
    "PREFIX",
    "MissionKey",
    "any_introspection_key",
    "any_layer_key",
    "checked_id",
    "introspection_key",
    "layer_key",
    "live_key",
    "live_service",
    "mission_key",
]

PREFIX = "oxbow/v1"
INTROSPECTION = ("ping", "info", "stats", "schema")
ANY_LIVE = f"{PREFIX}/live/*/*"


def live_key(service: str, instance: str) -> str:
    """The liveliness token of one process of a service; stages and other services alike."""
    return f"{PREFIX}/live/{checked_id(service)}/{checked_id(instance)}"


def live_service(key: str) -> tuple[str, str]:
    """The service and the instance of a liveliness token's key."""
    service, instance = key.removeprefix(f"{PREFIX}/live/").split("/")
    return service, instance


def introspection_key(service: str, instance: str, what: str) -> str:
    """Where a process of a service tells about itself; `what` is one of `INTROSPECTION`."""
    return f"{PREFIX}/stage/{checked_id(service)}/{checked_id(instance)}/@{what}"


def any_introspection_key(what: str) -> str:
    """Asks every replica of every stage; `what` is one of `INTROSPECTION`."""
    return f"{PREFIX}/stage/*/*/@{what}"


ANY = "*"
"""In place of one chunk of a key, matches all."""


@dataclass(frozen=True)
class MissionKey:
    """``oxbow/v1/mission/{id}/{what}``, or ``.../{what}/{revision}`` for the history of plans and replans.

    Parameters
    ----------
    mission_id
        One mission, or `ANY`.
    what
        ``request``, ``status``, ``plan``, ``report`` or ``replan``.
    revision
        One revision, `ANY`, or None for the latest.
    """

    mission_id: str
    what: str
    revision: int | str | None = None

    def __str__(self) -> str:
        key = f"{PREFIX}/mission/{self.mission_id}/{self.what}"
        return key if self.revision is None else f"{key}/{self.revision}"

    @classmethod
    def parse(cls, key: str) -> MissionKey:
        """Take a key apart; the id is as it came, fit for a reply or not."""
        match = _MISSION_KEY.fullmatch(key)
        if match is None:
            expected = f"{PREFIX}/mission/{{id}}/{{what}}[/{{revision}}], each one name, number or {ANY}"
            raise InvalidMission(f"is {excerpt(key)}; expected {expected}", where="key")
        mission_id, what, revision = match.groups()
        return cls(mission_id, what, int(revision) if revision and revision != ANY else revision)


_MISSION_KEY = re.compile(rf"{PREFIX}/mission/([^/]+)/([a-z]+)(?:/([0-9]{{1,9}}|\*))?")


def mission_key(mission_id: str, what: str) -> str:
    """The key of one mission; ``oxbow/v1/mission/{id}/{what}``."""
    return str(MissionKey(checked_id(mission_id), what))


PLAN_KEY = f"{PREFIX}/plan"


def layer_key(mission_id: str, stage: str, name: str) -> str:
    """Where a stage's layer of one mission is put."""
    return f"{PREFIX}/layer/{checked_id(mission_id)}/{checked_id(stage)}/{checked_id(name)}"


ANY_LAYER = f"{PREFIX}/layer/*/*/*"


def any_layer_key(stage: str) -> str:
    """Every layer that a stage shows, of any mission."""
    return f"{PREFIX}/layer/*/{checked_id(stage)}/*"
