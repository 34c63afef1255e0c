"""What a checking helper process does: it reads a request and checks its geometry."""

from __future__ import annotations

import msgspec

from oxbow.planning.submission import Submission
from oxbow.site.site import Site
from oxbow_mission.peer import Peer
from oxbow_mission.wire import Check, Checked, FromHelper, ToHelper

__all__ = ["check"]


def check(order: ToHelper, _peer: Peer) -> FromHelper:
    """Check all of a request, so that a fault is reported before the mission is accepted.

    Parameters
    ----------
    order
        A `Check`.
    _peer
        The mission service, which is not asked anything.

    Returns
    -------
    Checked
        What the request is to be kept as.

    Raises
    ------
    OxbowError
        What is wrong with the request.
    """
    assert isinstance(order, Check)
    submission = Submission.parse(order.document, order.parameters)
    Site.of(submission.mission)
    return Checked(
        mission_id=submission.mission_id,
        client=submission.parameters.client,
        document=submission.document,
        parameters=msgspec.json.encode(submission.parameters),
        fingerprint=submission.fingerprint,
        deadline_s=submission.parameters.deadline_s,
    )
