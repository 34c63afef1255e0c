"""All key expressions: no other module spells one."""

from __future__ import annotations

import re
from dataclasses import dataclass

from oxbow.errors import InvalidRequest
from oxbow.ids import checked_id, excerpt

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
    """The liveliness token of one process of a service.

    Parameters
    ----------
    service
        A stage, or another service such as `mission`.
    instance
        One process of it.

    Returns
    -------
    str
        ``oxbow/v1/live/{service}/{instance}``.

    Raises
    ------
    InvalidRequest
        One of them is not accepted (`checked_id`).
    """
    return f"{PREFIX}/live/{checked_id(service)}/{checked_id(instance)}"


def live_service(key: str) -> tuple[str, str]:
    """The service and the instance of a liveliness token's key."""
    service, instance = key.removeprefix(f"{PREFIX}/live/").split("/")
    return service, instance


def introspection_key(service: str, instance: str, what: str) -> str:
    """Where a process of a service reports about itself.

    Parameters
    ----------
    service
        A stage, or another service.
    instance
        One process of it.
    what
        One of `INTROSPECTION`; of the supervisor, ``processes``.

    Returns
    -------
    str
        ``oxbow/v1/stage/{service}/{instance}/@{what}``.

    Raises
    ------
    InvalidRequest
        `service` or `instance` is not accepted (`checked_id`).
    """
    return f"{PREFIX}/stage/{checked_id(service)}/{checked_id(instance)}/@{what}"


def any_introspection_key(what: str) -> str:
    """Addresses every replica of every stage; `what` is one of `INTROSPECTION`."""
    return f"{PREFIX}/stage/*/*/@{what}"


ANY = "*"
"""Matches any one chunk of a key."""


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
        """Take a key apart.

        The id is not checked, so that a key with a bad one can still be answered.

        Raises
        ------
        InvalidRequest
            It is not the key of a mission.
        """
        match = _MISSION_KEY.fullmatch(key)
        if match is None:
            expected = f"{PREFIX}/mission/{{id}}/{{what}}[/{{revision}}], each one name, number or {ANY}"
            raise InvalidRequest(f"is {excerpt(key)}; expected {expected}", where="key")
        mission_id, what, revision = match.groups()
        return cls(mission_id, what, int(revision) if revision and revision != ANY else revision)


# At most nine digits: Python refuses to convert a number of thousands, and a key comes from anybody.
_MISSION_KEY = re.compile(rf"{PREFIX}/mission/([^/]+)/([a-z]+)(?:/([0-9]{{1,9}}|\*))?")


def mission_key(mission_id: str, what: str) -> str:
    """The key of one mission: ``oxbow/v1/mission/{id}/{what}``.

    Parameters
    ----------
    mission_id
        One mission.
    what
        As in `MissionKey`; also ``cancel``.

    Returns
    -------
    str
        ``oxbow/v1/mission/{id}/{what}``.

    Raises
    ------
    InvalidRequest
        The id is not accepted (`checked_id`).
    """
    return str(MissionKey(checked_id(mission_id), what))


PLAN_KEY = f"{PREFIX}/plan"


def layer_key(mission_id: str, stage: str, name: str) -> str:
    """Where a stage publishes a layer of one mission.

    Parameters
    ----------
    mission_id
        The mission that was planned.
    stage
        The stage that shows the layer.
    name
        The layer's name.

    Returns
    -------
    str
        ``oxbow/v1/layer/{id}/{stage}/{name}``.

    Raises
    ------
    InvalidRequest
        One of them is not accepted (`checked_id`).
    """
    return f"{PREFIX}/layer/{checked_id(mission_id)}/{checked_id(stage)}/{checked_id(name)}"


ANY_LAYER = f"{PREFIX}/layer/*/*/*"


def any_layer_key(stage: str) -> str:
    """Every layer that a stage shows, of any mission."""
    return f"{PREFIX}/layer/*/{checked_id(stage)}/*"
