"""What the Mission File calls the fields that stages speak of.

Stages know requests, not the Mission File: their errors name a field of the request (`where`), and their texts put
such names between backquotes. Here is the one table that turns both into what the mission's author wrote.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TypeVar

from msgspec import structs

from oxbow.contracts import Assignment, Call, DroppedPart, Endpoint, FreeSpace, Message, PathPlan
from oxbow.errors import InvalidMission, InvalidRequest, OxbowError
from oxbow.mission.file import JSON_NAMES, Mission
from oxbow.site.fleet import Member
from oxbow.site.site import Site

__all__ = ["FieldNames", "NamedCall"]

Q = TypeVar("Q", bound=Message)
R = TypeVar("R", bound=Message)

_SAME_FIELDS = (
    "safety_m",
    "least_width_m",
    "shore_tolerance_m",
    "danger_detour_m",
    "footprint_m",
    "danger_zones",
    "vehicles",
)
"""Fields that requests and missions call the same, in Python."""

_QUOTED = re.compile("`([^`]+)`")


@dataclass(frozen=True)
class FieldNames:
    """The Mission File's names of the fields of requests to stages.

    Parameters
    ----------
    names
        The name in the Mission File of each field of a request; a field that is not among them keeps its own.
    """

    names: Mapping[str, str]

    @classmethod
    def of_mission(cls, mission: Mission, site: Site) -> FieldNames:
        """Of all that requests take from a mission.

        Parameters
        ----------
        mission
            The mission.
        site
            Its site, which has the places and the vehicles in the order in which requests have them.

        Returns
        -------
        FieldNames
            Without those of a request that is about one vehicle; see `of_member`.
        """
        names = {field: JSON_NAMES[field] for field in _SAME_FIELDS} | {
            "outline": mission.outline_name.value,
            "zones": "ForbiddenZones",
            "min_spacing_m": "Minimal_spatial_rate",
            # The spatial rate stands in for a swath that the mission does not give.
            "swath_m": "Minimal_spatial_rate" if mission.swath_m is None else "Swath",
            "hot_spots": "PriorModel",
        }
        names |= {f"places[{index}]": field for index, field in enumerate(site.ends)}
        for member in site.members:
            own = {
                "start": member.fields.start,
                "recovery": member.fields.recovery,
                "length_m": member.fields.length,
            }
            names |= {member.vehicle.field(field): name for field, name in own.items()}
        return cls(names)

    @classmethod
    def of_member(cls, member: Member) -> FieldNames:
        """Of a request that is about one vehicle.

        Parameters
        ----------
        member
            The vehicle.
        """
        fields = member.fields
        return cls({"launch": fields.start, "recovery": fields.recovery, "length_m": fields.length})

    @contextmanager
    def in_errors(self) -> Iterator[None]:
        """Have errors that are raised within name fields of the Mission File.

        A request that breaks its contract by a field that the mission gave is a fault of the mission.
        """
        try:
            yield
        except OxbowError as error:
            kind = (
                InvalidMission if isinstance(error, InvalidRequest) and error.where in self.names else type(error)
            )
            raise kind(self.in_text(error.message), self.names.get(error.where, error.where)) from error

    def in_text(self, text: str) -> str:
        """A text in which fields between backquotes have the Mission File's names, without the backquotes."""
        return _QUOTED.sub(lambda match: self.names.get(match[1], match[0]), text)

    def in_reply(self, reply: R) -> R:
        """A reply with the Mission File's names in its warnings and reasons."""
        changes: dict[str, object] = {}
        if isinstance(reply, FreeSpace | PathPlan | Assignment):
            changes["warnings"] = tuple(map(self.in_text, reply.warnings))
            changes["dropped"] = tuple(map(self._dropped, reply.dropped))
        if isinstance(reply, Assignment):
            changes["left"] = tuple(structs.replace(left, reason=self.in_text(left.reason)) for left in reply.left)
        return structs.replace(reply, **changes) if changes else reply

    def _dropped(self, part: DroppedPart) -> DroppedPart:
        return structs.replace(part, reason=self.in_text(part.reason))


@dataclass(frozen=True)
class NamedCall:
    """A call whose replies and errors have the Mission File's names.

    Parameters
    ----------
    call
        How the stages are reached.
    names
        The Mission File's names.
    """

    call: Call
    names: FieldNames

    def __call__(self, endpoint: Endpoint[Q, R], request: Q, /, *, part: str = "") -> R:
        """Call a stage (`oxbow.contracts.Call`)."""
        with self.names.in_errors():
            return self.names.in_reply(self.call(endpoint, request, part=part))
