"""A mission as it is handed in: with how to plan it, what makes two requests the same, and the id it gets."""

from __future__ import annotations

import hashlib
import importlib.metadata
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any
from urllib.parse import quote

import msgspec

from oxbow.contracts import DEFAULT_DEADLINE_S, MOST_DEADLINE_S, checked_id, require_finite
from oxbow.errors import InvalidRequest
from oxbow.ids import excerpt
from oxbow.mission.file import Mission, PlanOptions, mission_json, parse_mission
from oxbow.wire.parameters import require_known
from oxbow.wire.strict_json import described

__all__ = ["Submission", "SubmissionParameters"]

MOST_NAME_CHARACTERS = 48


class SubmissionParameters(PlanOptions, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """The parameters of a query that hands in a mission: ``?id=lake;method=Transect;seed=3;deadline_s=60``.

    Parameters
    ----------
    id
        The mission's id; by default one is made of the site's name and the content.
    deadline_s
        Seconds that planning may take, its wait for a free planner not counted; at most a day.
    client
        Who hands it in, by the name of its liveliness token ``oxbow/v1/live/client/{client}``: clients take turns,
        and requests that wait for a client that is gone are dropped. Those without a name count as one client.
    """

    id: str | None = None
    deadline_s: float = DEFAULT_DEADLINE_S
    client: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        require_finite(self, "deadline_s", above=0.0, most=MOST_DEADLINE_S)
        if self.id is not None:
            checked_id(self.id)
        if self.client:
            checked_id(self.client, "client")

    @classmethod
    def parse(cls, parameters: Mapping[str, str]) -> SubmissionParameters:
        """Read the text of parameters; `InvalidRequest` names the one that is unknown or mistyped."""
        kinds = {field.name: field.type for field in msgspec.structs.fields(cls)}
        require_known(parameters, kinds)
        return cls(**{name: _value(name, text, kinds[name]) for name, text in parameters.items()})

    @property
    def text(self) -> str:
        """The parameters as a query carries them, those with default values left out."""
        return ";".join(f"{name}={quote(str(value))}" for name, value in msgspec.to_builtins(self).items())


@dataclass(frozen=True)
class Submission:
    """A mission to plan, and how.

    Parameters
    ----------
    mission
        The mission; an earlier plan in it is no part of what is asked.
    parameters
        How to plan it, and under which id.
    """

    mission: Mission
    parameters: SubmissionParameters = field(default_factory=SubmissionParameters)

    @classmethod
    def parse(cls, document: bytes, parameters: Mapping[str, str]) -> Submission:
        """Read a query; `InvalidMission` or `InvalidRequest` where it cannot be read.

        Parameters
        ----------
        document
            Its payload, a Mission File in JSON.
        parameters
            Its parameters as text; see `SubmissionParameters`.

        Returns
        -------
        Submission
            With defaults for the parameters that are absent.
        """
        return cls(parse_mission(document), SubmissionParameters.parse(parameters))

    @cached_property
    def document(self) -> bytes:
        """The Mission File without an earlier plan: the same bytes for the same mission however it was written."""
        unplanned = msgspec.structs.replace(self.mission, master_path=None, slave_path=None, paths=None, plan=None)
        return mission_json(unplanned)

    @cached_property
    def fingerprint(self) -> str:
        """Equal for two submissions that this version of Oxbow gives the same plan."""
        # Neither who asks nor how long they wait changes the plan.
        options = msgspec.structs.replace(self.parameters, id=None, deadline_s=DEFAULT_DEADLINE_S, client="")
        # A newer Oxbow may plan the same mission otherwise: what an older one planned does not answer for it.
        digest = hashlib.sha256(_version().encode())
        digest.update(msgspec.json.encode(options))
        digest.update(self.document)
        return digest.hexdigest()

    @property
    def parameters_text(self) -> str:
        """The parameters as a query carries them, the id among them."""
        return msgspec.structs.replace(self.parameters, id=self.mission_id).text

    @property
    def mission_id(self) -> str:
        """The id asked for, or else one made of the site's name and the content."""
        if self.parameters.id is not None:
            return self.parameters.id
        name = re.sub(r"[^A-Za-z0-9_.-]+", "-", self.mission.site_name or "")[:MOST_NAME_CHARACTERS]
        return f"{name.strip('-.') or 'mission'}-{self.fingerprint[:8]}"


def _value(name: str, text: str, kind: Any) -> Any:
    """What the text of a parameter says, as a value of the type `kind`."""
    try:
        # Not strict: the parameters of a query are text, those that are numbers as well.
        return msgspec.convert(text, kind, strict=False)
    except msgspec.ValidationError as error:
        raise InvalidRequest(f"is {excerpt(text)}; expected {described(kind)}", where=name) from error


@cache
def _version() -> str:
    return importlib.metadata.version("oxbow")
