"""The client of a decision-support system (DSS) or of a vehicle's guidance: `oxbow.Client`.

>>> with oxbow.Client("tcp/127.0.0.1:7447") as client:  # doctest: +SKIP
...     planned = client.plan("lake.json")
...     for update in client.replans(planned.plan.mission_id):
...         steer(update.mission.master_path)
"""

from __future__ import annotations

import queue
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TypedDict, TypeVar, Unpack

import msgspec

from oxbow.bus import DEFAULT_ENDPOINT, Bus
from oxbow.closing import Closing
from oxbow.contracts import (
    ANY,
    DEFAULT_DEADLINE_S,
    PLAN_KEY,
    Draw,
    Method,
    MissionKey,
    MissionStatus,
    checked_id,
    mission_key,
)
from oxbow.errors import Busy, InvalidMission, Unavailable
from oxbow.mission import Mission, parse_mission, read_mission
from oxbow.submission import Submission, SubmissionParameters

__all__ = ["Client", "Options", "PlanUpdate", "PlanUpdates"]

R = TypeVar("R")

ANSWER_S = 30.0
"""How long the mission service may take to answer what needs no planning."""
RETRY_PAUSE_S = 0.2


class Options(TypedDict, total=False):
    """How to plan; see `oxbow.plan.PlanOptions`."""

    method: Method
    seed: int
    heading_rad: float | None
    tolerance_m: float | None
    time_limit_s: float | None
    smooth: bool
    draw: Draw


@dataclass(frozen=True)
class PlanUpdate:
    """A new plan: the completed mission, and the revision of the mission that it plans."""

    mission_id: str
    revision: int
    mission: Mission


class PlanUpdates(Closing, Iterator[PlanUpdate]):
    """Plans as they are made, each once, those of one mission by rising revision; blocks while there is none.

    Iteration ends when it is closed, by whichever thread, or after `timeout_s` without an update.
    """

    def __init__(self, bus: Bus, key: MissionKey, kept: Iterator[PlanUpdate], timeout_s: float | None) -> None:
        self.timeout_s = timeout_s
        self._kept: Iterator[PlanUpdate] = kept
        self._live: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._seen: dict[str, int] = {}
        # Before what is kept is asked for, so that nothing is missed between the two.
        self._subscription = bus.subscribe(str(key), lambda _key, payload: self._live.put(payload))

    def __next__(self) -> PlanUpdate:
        while True:
            update = next(self._kept, None) or self._next_live()
            if update.revision > self._seen.get(update.mission_id, 0):
                self._seen[update.mission_id] = update.revision
                return update

    def _next_live(self) -> PlanUpdate:
        try:
            payload = self._live.get(timeout=self.timeout_s)
        except queue.Empty:
            payload = None
        if payload is None:
            self.close()
            raise StopIteration
        return _plan_update(payload)

    def close(self) -> None:
        """Receive nothing more, and end the iteration."""
        self._kept = iter(())
        self._subscription.close()
        self._live.put(None)


class Client(Closing):
    """Hands missions to Oxbow and receives plans; a context manager, safe to share between threads.

    Parameters
    ----------
    endpoint
        Where the router listens.
    timeout_s
        How long to wait for the router and the mission service.

    Raises
    ------
    Unavailable
        There is no router there, or no mission service.
    """

    def __init__(self, endpoint: str = DEFAULT_ENDPOINT, *, timeout_s: float = 10.0) -> None:
        give_up = time.monotonic() + timeout_s
        with ExitStack() as stack:
            self._bus = stack.enter_context(Bus.connect(endpoint, timeout_s=timeout_s))
            self._bus.wait_ready(["mission"], max(0.0, give_up - time.monotonic()))
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
            The completed mission; its `plan` tells id and revision.

        Raises
        ------
        InvalidMission, Infeasible
            What is wrong with the mission.
        DeadlineExceeded
            There is no plan after `timeout_s`.
        Unavailable, Busy, Internal
            It cannot be planned now.
        """
        submission = _submission(mission, mission_id, timeout_s, options)
        with ExitStack() as stack:
            if on_status is not None:
                key = mission_key(submission.mission_id, "status")
                subscription = self._bus.subscribe(key, lambda _key, payload: on_status(_status(payload)))
                stack.callback(subscription.close)
            return parse_mission(self._ask(PLAN_KEY, submission, timeout_s))

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
            As of `plan`.
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
        submission = _submission(mission, mission_id, deadline_s, options)
        return _status(self._ask(mission_key(submission.mission_id, "request"), submission, ANSWER_S))

    def status(self, mission_id: str) -> MissionStatus:
        """Where the latest revision of a mission stands; `InvalidMission` where there is no such mission."""
        return _status(self._ask_kept(mission_key(mission_id, "status"))[0][1])

    def statuses(self) -> list[MissionStatus]:
        """Where the latest revision of each mission stands, oldest mission first."""
        try:
            replies = self._ask_kept(str(MissionKey(ANY, "status")))
        except InvalidMission:
            return []
        return [_status(payload) for _key, payload in replies]

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
            End after so many seconds without an update; never where absent.
        """
        return self._updates("plan", mission_id, history, timeout_s)

    def replans(self, mission_id: str, *, history: bool = True, timeout_s: float | None = None) -> PlanUpdates:
        """The plans that take the place of a mission's first one, as `plans` does."""
        return self._updates("replan", mission_id, history, timeout_s)

    def _updates(self, what: str, mission_id: str | None, history: bool, timeout_s: float | None) -> PlanUpdates:
        key = MissionKey(ANY if mission_id is None else checked_id(mission_id), what)
        updates = PlanUpdates(self._bus, key, self._kept(key) if history else iter(()), timeout_s)
        self._stack.callback(updates.close)
        return updates

    def _kept(self, key: MissionKey) -> Iterator[PlanUpdate]:
        """The plans in the service's store, asked for mission by mission."""
        every = key.mission_id == ANY
        mission_ids = [status.mission_id for status in self.statuses()] if every else [key.mission_id]
        for mission_id in mission_ids:
            try:
                replies = self._ask_kept(str(MissionKey(mission_id, key.what, ANY)))
            except InvalidMission:  # nothing is kept of it
                continue
            updates = [_plan_update(payload) for _key, payload in replies]
            yield from sorted(updates, key=lambda update: update.revision)

    def _ask_kept(self, key: str) -> list[tuple[str, bytes]]:
        return self._retry(lambda remaining_s: self._bus.query(key, timeout_s=remaining_s), ANSWER_S)

    def _ask(self, key: str, submission: Submission, timeout_s: float) -> bytes:
        selector = f"{key}?{submission.parameters_text}"
        document = submission.document
        return self._retry(
            lambda remaining_s: self._bus.query(selector, document, timeout_s=remaining_s)[0][1], timeout_s
        )

    def _retry(self, ask: Callable[[float], R], timeout_s: float) -> R:
        """Ask anew while the service is away or busy: whatever it is asked, it may be asked again."""
        give_up = time.monotonic() + timeout_s
        while True:
            try:
                return ask(max(RETRY_PAUSE_S, give_up - time.monotonic()))
            except (Busy, Unavailable):
                if time.monotonic() + RETRY_PAUSE_S > give_up:
                    raise
            time.sleep(RETRY_PAUSE_S)


def _submission(
    mission: Mission | bytes | Path | str, mission_id: str | None, deadline_s: float, options: Options
) -> Submission:
    if isinstance(mission, bytes):
        mission = parse_mission(mission)
    elif isinstance(mission, Path | str):
        mission = read_mission(mission)
    return Submission(mission, SubmissionParameters(id=mission_id, deadline_s=deadline_s, **options))


def _status(payload: bytes) -> MissionStatus:
    return msgspec.json.decode(payload, type=MissionStatus)


def _plan_update(payload: bytes) -> PlanUpdate:
    mission = parse_mission(payload)
    if mission.plan is None or mission.plan.mission_id is None or mission.plan.revision is None:
        raise InvalidMission(
            "has no mission_id and revision; expected what the mission service plans", where="Plan"
        )
    return PlanUpdate(mission.plan.mission_id, mission.plan.revision, mission)
