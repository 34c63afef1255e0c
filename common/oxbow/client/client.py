"""The client of a decision-support system (DSS) or of a vehicle's guidance: `oxbow.Client`.

>>> with oxbow.Client("tcp/127.0.0.1:7447") as client:  # doctest: +SKIP
...     planned = client.plan("lake.json")
...     for update in client.replans(planned.plan.mission_id):
...         steer(update.mission.master_path)
"""

from __future__ import annotations

import logging
import time
import uuid
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TypedDict, TypeVar, Unpack

from oxbow.bus import DEFAULT_ENDPOINT, Subscription
from oxbow.bus.client import Bus
from oxbow.client.updates import ANSWER_S, PlanUpdates, kept_plan, read_status
from oxbow.contracts import (
    ANY,
    DEFAULT_DEADLINE_S,
    PLAN_KEY,
    Draw,
    Method,
    MissionKey,
    MissionStatus,
    RouteMethod,
    checked_id,
    live_key,
    mission_key,
)
from oxbow.errors import Busy, Internal, InvalidInput, Unavailable
from oxbow.ids import excerpt
from oxbow.mission.file import Mission, parse_mission, read_mission
from oxbow.planning.submission import Submission, SubmissionParameters
from oxbow.runtime.closing import Closing
from oxbow.wire.waits import checked_wait

__all__ = ["Client", "Options"]

R = TypeVar("R")

RETRY_PAUSE_S = 0.2

_log = logging.getLogger(__name__)


class Options(TypedDict, total=False):
    """How to plan; see `oxbow.mission.plan.PlanOptions`."""

    method: Method
    seed: int
    heading_rad: float | None
    tolerance_m: float | None
    time_limit_s: float | None
    smooth: bool
    draw: Draw
    router: RouteMethod


class Client(Closing):
    """Hands missions to Oxbow and receives plans; a context manager, safe to share between threads.

    Parameters
    ----------
    endpoint
        Where the router listens.
    timeout_s
        How long to wait for the router and the mission service.

    Attributes
    ----------
    client_id
        The name under which the service tells this client from others, with which it takes turns.

    Raises
    ------
    Unavailable
        There is no router there, or no mission service.
    """

    def __init__(self, endpoint: str = DEFAULT_ENDPOINT, *, timeout_s: float = 10.0) -> None:
        give_up = time.monotonic() + checked_wait(timeout_s, "timeout_s")
        self.client_id = uuid.uuid4().hex
        with ExitStack() as stack:
            self._bus = stack.enter_context(Bus.connect(endpoint, timeout_s=timeout_s))
            # The wait for the router has used part of the time.
            self._bus.wait_ready(["mission"], max(0.0, give_up - time.monotonic()))
            # While it is there, the service waits for answers with this client.
            self._bus.declare_live(live_key("client", self.client_id))
            # Nothing is raised from this line on: until it, whatever fails leaves the bus again.
            self._stack = stack.pop_all()

    def close(self) -> None:
        """Leave the bus."""
        self._stack.close()

    def plan(
        self,
        mission: Mission | bytes | Path | str,
        *,
        mission_id: str | None = None,
        timeout_s: float = DEFAULT_DEADLINE_S,
        on_status: Callable[[MissionStatus], None] | None = None,
        **options: Unpack[Options],
    ) -> Mission:
        """Plan a mission: ``I3S.MissionPlan`` (Rendas and Li 2016, section 1.1).

        Asked again for the same mission, id and options, the service answers with the plan it has. That makes it
        safe to ask anew when the service goes away meanwhile, which this method does.

        Parameters
        ----------
        mission
            A mission, the JSON of a Mission File, or its path.
        mission_id
            By default, one made of the site's name and the content.
        timeout_s
            Seconds to wait, and the most that planning may take.
        on_status
            Called, on a thread of its own, with every status of the mission.

        Returns
        -------
        Mission
            The completed mission; its `plan` has the id and the revision.

        Raises
        ------
        InvalidMission, Infeasible
            What is wrong with the mission.
        DeadlineExceeded
            There is no plan after `timeout_s`.
        Cancelled
            Someone cancelled it.
        Unavailable, Busy
            It cannot be planned now.
        Internal
            A fault of Oxbow, or an answer that is not of this mission, which is never returned.
        """
        submission = self._submission(mission, mission_id, timeout_s, options)
        with ExitStack() as stack:
            # Before the mission is handed in, so that no status is missed.
            if on_status is not None:
                stack.callback(self._hear_statuses(submission.mission_id, on_status).close)
            return _own_plan(self._ask(PLAN_KEY, submission, timeout_s)[0][1], submission)

    def submit(
        self,
        mission: Mission | bytes | Path | str,
        *,
        mission_id: str | None = None,
        deadline_s: float = DEFAULT_DEADLINE_S,
        **options: Unpack[Options],
    ) -> MissionStatus:
        """Hand in a mission and return once it is on the service's disk: from then on it will not be lost.

        Parameters
        ----------
        mission, mission_id, options
            As in `plan`.
        deadline_s
            Seconds that planning may take.

        Returns
        -------
        MissionStatus
            The receipt, with the mission's id and the revision that it became.

        Raises
        ------
        InvalidMission, Infeasible
            What is wrong with the mission.
        Unavailable, Busy, DeadlineExceeded
            The service did not answer.
        """
        submission = self._submission(mission, mission_id, deadline_s, options)
        replies = self._ask(mission_key(submission.mission_id, "request"), submission, ANSWER_S)
        return _own_status(replies, submission.mission_id)

    def cancel(self, mission_id: str) -> MissionStatus:
        """End whatever of a mission waits or is being planned, which then has `failed`, `cancelled`.

        Returns
        -------
        MissionStatus
            Of the latest revision; one that was done before stays so.

        Raises
        ------
        InvalidRequest
            There is no such mission.
        """
        return _own_status(self._ask_kept(mission_key(mission_id, "cancel")), mission_id)

    def status(self, mission_id: str) -> MissionStatus:
        """Where the latest revision of a mission stands; `InvalidRequest` where there is no such mission."""
        return _own_status(self._ask_kept(mission_key(mission_id, "status")), mission_id)

    def statuses(self) -> list[MissionStatus]:
        """Where the latest revision of each mission stands, oldest mission first."""
        try:
            replies = self._ask_kept(str(MissionKey(ANY, "status")))
        # The service refuses a query that matches no mission; without any mission, that is no fault.
        except InvalidInput:
            return []
        return list(_readable_statuses(replies))

    def plans(
        self, mission_id: str | None = None, *, history: bool = True, timeout_s: float | None = None
    ) -> PlanUpdates:
        """The plans of one mission, or of all: those that are kept, then new ones as they are made.

        Parameters
        ----------
        mission_id
            All missions where absent.
        history
            Whether to begin with the plans that were made before.
        timeout_s
            End after this many seconds without an update; never where absent.

        Returns
        -------
        PlanUpdates
            An iterator that waits for plans, until it or the client is closed.
        """
        return self._updates("plan", mission_id, history, timeout_s)

    def replans(self, mission_id: str, *, history: bool = True, timeout_s: float | None = None) -> PlanUpdates:
        """The plans that take the place of a mission's first one.

        Parameters
        ----------
        mission_id
            The mission.
        history, timeout_s
            As in `plans`.

        Returns
        -------
        PlanUpdates
            An iterator that waits for them, until it or the client is closed.
        """
        return self._updates("replan", mission_id, history, timeout_s)

    def _updates(self, what: str, mission_id: str | None, history: bool, timeout_s: float | None) -> PlanUpdates:
        key = MissionKey(ANY if mission_id is None else checked_id(mission_id), what)
        updates = PlanUpdates(self._bus, key, history=history, timeout_s=timeout_s)
        self._stack.callback(updates.close)
        return updates

    def _ask_kept(self, key: str) -> list[tuple[str, bytes]]:
        return self._retry(lambda remaining_s: self._bus.query(key, timeout_s=remaining_s), ANSWER_S)

    def _submission(
        self, mission: Mission | bytes | Path | str, mission_id: str | None, deadline_s: float, options: Options
    ) -> Submission:
        if isinstance(mission, bytes):
            mission = parse_mission(mission)
        elif isinstance(mission, Path | str):
            mission = read_mission(mission)
        # The id is settled here, not by the service: asked again, the same submission is then known to it.
        parameters = SubmissionParameters(id=mission_id, deadline_s=deadline_s, client=self.client_id, **options)
        return Submission(mission, parameters)

    def _hear_statuses(self, mission_id: str, on_status: Callable[[MissionStatus], None]) -> Subscription:
        def hear(key: str, payload: bytes) -> None:
            for status in _readable_statuses([(key, payload)], mission_id):
                on_status(status)

        return self._bus.subscribe(mission_key(mission_id, "status"), hear)

    def _ask(self, key: str, submission: Submission, timeout_s: float) -> list[tuple[str, bytes]]:
        selector = f"{key}?{submission.parameters_text}"
        document = submission.document
        return self._retry(
            lambda remaining_s: self._bus.query(selector, document, timeout_s=remaining_s), timeout_s
        )

    def _retry(self, ask: Callable[[float], R], timeout_s: float) -> R:
        """Ask anew while the service is away or busy: whatever it is asked, it may be asked again."""
        give_up = time.monotonic() + timeout_s
        while True:
            try:
                # Never 0: the last attempt, too, has time for an answer.
                return ask(max(RETRY_PAUSE_S, give_up - time.monotonic()))
            except (Busy, Unavailable):
                if time.monotonic() + RETRY_PAUSE_S > give_up:
                    raise
            time.sleep(RETRY_PAUSE_S)


def _readable_statuses(
    samples: Iterable[tuple[str, bytes]], mission_id: str | None = None
) -> Iterator[MissionStatus]:
    """Statuses, of one mission where given; a sample that is no status is logged and passed over."""
    for key, payload in samples:
        try:
            yield read_status(payload, mission_id)
        except InvalidInput as error:
            _log.warning("%s: ignored: %s", excerpt(key), error)


def _own_status(replies: list[tuple[str, bytes]], mission_id: str) -> MissionStatus:
    """The status of the mission that was asked for, and of no other."""
    try:
        return read_status(replies[0][1], mission_id)
    except InvalidInput as error:
        raise Internal(
            f"the mission service answered about another mission: {error}", where=f"mission {mission_id}"
        ) from error


def _own_plan(payload: bytes, submission: Submission) -> Mission:
    """The plan of the mission that was handed in, and of no other."""
    where = f"mission {submission.mission_id}"
    try:
        update = kept_plan(payload)
    except InvalidInput as error:
        raise Internal(f"the mission service's answer is not a plan: {error}", where=where) from error
    if update.mission_id != submission.mission_id or update.revision < 1:
        other = f"{excerpt(update.mission_id)}, revision {update.revision}"
        raise Internal(f"the mission service answered with the plan of mission {other}", where=where)
    # The document leaves out what planning adds: paths, plan, id and revision.
    if Submission(update.mission).document != submission.document:
        raise Internal("the mission service answered with a plan of different content", where=where)
    return update.mission
