"""The endpoints at which stages exchange their messages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from oxbow.contracts.assignment import Assignment, AssignRequest
from oxbow.contracts.certificate import Certificate, CertifyRequest
from oxbow.contracts.contour import ContourRequest, FreeSpace
from oxbow.contracts.decomposition import DecomposeRequest, Decomposition
from oxbow.contracts.keys import PREFIX, checked_id, introspection_key, live_key
from oxbow.contracts.message import Message
from oxbow.contracts.path import PathPlan, PathRequest

__all__ = ["ASSIGN", "CERTIFY", "CONTOUR", "DECOMPOSE", "MAX_REQUEST_BYTES", "PATH", "STAGES", "Call", "Endpoint"]

Q = TypeVar("Q", bound=Message)
R = TypeVar("R", bound=Message)

MAX_REQUEST_BYTES = 128 * 2**20


@dataclass(frozen=True)
class Endpoint(Generic[Q, R]):
    """One request/reply exchange that a stage serves."""

    stage: str
    request: type[Q]
    reply: type[R]

    def instance_key(self, instance: str) -> str:
        """Where one replica of the stage takes queries."""
        return f"{PREFIX}/stage/{self.stage}/{checked_id(instance)}"

    def introspection_key(self, instance: str, what: str) -> str:
        """Where one replica reports about itself.

        Parameters
        ----------
        instance
            One replica.
        what
            One of `INTROSPECTION`.

        Returns
        -------
        str
            ``oxbow/v1/stage/{stage}/{instance}/@{what}``.

        Raises
        ------
        InvalidRequest
            The instance is not accepted (`checked_id`).
        """
        return introspection_key(self.stage, instance, what)

    def live_key(self, instance: str) -> str:
        """The liveliness token of one replica."""
        return live_key(self.stage, instance)


class Call(Protocol):
    """Calls a stage: over the bus (`oxbow.bus.client.BusCall`) or in this process (`oxbow.stage.local.LocalCall`).

    `part` names the vehicle or the role that the request is about, where a mission has several, for recordings.
    """

    def __call__(self, endpoint: Endpoint[Q, R], request: Q, /, *, part: str = "") -> R: ...


CONTOUR: Endpoint[ContourRequest, FreeSpace] = Endpoint("contour", ContourRequest, FreeSpace)
DECOMPOSE: Endpoint[DecomposeRequest, Decomposition] = Endpoint("decomposition", DecomposeRequest, Decomposition)
PATH: Endpoint[PathRequest, PathPlan] = Endpoint("path", PathRequest, PathPlan)
ASSIGN: Endpoint[AssignRequest, Assignment] = Endpoint("assignment", AssignRequest, Assignment)
CERTIFY: Endpoint[CertifyRequest, Certificate] = Endpoint("certificate", CertifyRequest, Certificate)

STAGES: tuple[Endpoint[Any, Any], ...] = (CONTOUR, ASSIGN, DECOMPOSE, PATH, CERTIFY)
