"""Plans as they are made, for whoever follows them: each is one that the mission service keeps, or is passed over.

A publication is heard at most once, and anyone may put one. So it is only a sign that there may be something new:
what is followed comes from the service's history, which is asked after each publication, after each loss of the
link to the router, and now and then.
"""

from __future__ import annotations

import logging
import queue
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import msgspec

from oxbow.bus.client import Bus
from oxbow.contracts import ANY, MissionKey, MissionStatus
from oxbow.errors import InvalidInput, InvalidRequest, OxbowError, Unavailable
from oxbow.ids import excerpt
from oxbow.mission.file import Mission, parse_mission
from oxbow.runtime.closing import Closing
from oxbow.wire.waits import checked_wait

__all__ = ["PlanUpdate", "PlanUpdates", "kept_plan", "read_status"]

ANSWER_S = 30.0
"""How long the mission service may take to answer what needs no planning."""
CATCH_UP_S = 5.0
"""How often the service is asked whether a plan was missed."""
LOOK_S = 0.25

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class PlanUpdate:
    """A new plan: the completed mission, and the revision of the mission that it plans."""

    mission_id: str
    revision: int
    mission: Mission


def kept_plan(payload: bytes) -> PlanUpdate:
    """The plan in a Mission File that the mission service completed.

    Raises
    ------
    InvalidInput
        It is no Mission File, or has no plan with the id and the revision that it is kept under.
    """
    mission = parse_mission(payload)
    if mission.plan is None or mission.plan.mission_id is None or mission.plan.revision is None:
        raise InvalidRequest(
            "has no mission_id and revision; expected what the mission service plans", where="Plan"
        )
    return PlanUpdate(mission.plan.mission_id, mission.plan.revision, mission)


def read_status(payload: bytes, mission_id: str | None = None) -> MissionStatus:
    """The status that a payload holds.

    Parameters
    ----------
    payload
        JSON.
    mission_id
        The mission that it must be about; any where absent.

    Returns
    -------
    MissionStatus
        Of that mission, where one is named.

    Raises
    ------
    InvalidRequest
        It is no status, or is about another mission.
    """
    try:
        status = msgspec.json.decode(payload, type=MissionStatus)
    except (msgspec.MsgspecError, ValueError) as error:
        raise InvalidRequest(f"is not a MissionStatus: {error}", where="status") from error
    if mission_id is not None and status.mission_id != mission_id:
        raise InvalidRequest(f"is of {excerpt(status.mission_id)}; expected {mission_id!r}", where="status")
    return status


def _keyed_plan(key: str, payload: bytes) -> PlanUpdate:
    """The plan under a key, if it is the one that the key names."""
    named, update = MissionKey.parse(key), kept_plan(payload)
    if update.mission_id != named.mission_id:
        raise InvalidRequest(
            f"is {excerpt(update.mission_id)}; expected that of its key, {excerpt(named.mission_id)}",
            where="Plan.mission_id",
        )
    if named.revision not in (None, update.revision):
        raise InvalidRequest(
            f"is {update.revision}; expected that of its key, {named.revision}", where="Plan.revision"
        )
    return update


class PlanUpdates(Closing, Iterator[PlanUpdate]):
    """Plans as they are made, each once, those of one mission by rising revision; blocks while there is none.

    What is put under the key of a plan without being one that the service keeps is logged and passed over. A plan
    that was missed, because the router or the service was away, is found by asking.

    Iteration ends when it is closed, by whichever thread, or after `timeout_s` without an update.

    Parameters
    ----------
    bus
        Reaches the mission service.
    key
        The plans or replans to follow, of one mission or of all.
    history
        Whether to begin with those that were made before.
    timeout_s
        End after this many seconds without an update; never where absent.

    Raises
    ------
    OxbowError
        The service does not answer what was there before.
    """

    def __init__(self, bus: Bus, key: MissionKey, *, history: bool, timeout_s: float | None) -> None:
        self.timeout_s = None if timeout_s is None else checked_wait(timeout_s, "timeout_s")
        self._bus = bus
        self._key = key
        self._pending: deque[PlanUpdate] = deque()
        self._live: queue.SimpleQueue[tuple[str, bytes] | None] = queue.SimpleQueue()
        self._seen: dict[str, int] = {}
        # Some revisions have no plan to see, as those that failed: they must not be asked for at every look.
        self._asked: dict[str, int] = {}
        self._closed = False
        self._links = bus.links
        self._due_s = 0.0
        self._is_behind = False
        # Before what is kept is asked for, so that nothing is missed between the two.
        self._subscription = bus.subscribe(str(key), lambda *sample: self._live.put(sample))
        try:
            if history:
                self._first_catch_up()
            else:
                # Only what comes after these is new; a revision that is being planned now is among it.
                self._seen = {status.mission_id: _last_of(status) for status in self._statuses()}
        except BaseException:
            self.close()
            raise

    def __next__(self) -> PlanUpdate:
        idle_since = time.monotonic()
        while not self._closed:
            if self._pending:
                return self._pending.popleft()
            if self._is_due():
                self._try_to_catch_up()
            elif self.timeout_s is not None and time.monotonic() - idle_since >= self.timeout_s:
                self.close()
            else:
                self._listen(LOOK_S if self.timeout_s is None else min(LOOK_S, self.timeout_s))
        raise StopIteration

    def close(self) -> None:
        """Receive nothing more, and end the iteration."""
        self._closed = True
        self._subscription.close()
        # Wakes a thread that waits in `_listen`, which then sees that it is over.
        self._live.put(None)

    # ----------------------------------------------------------------- listening

    def _listen(self, wait_s: float) -> None:
        try:
            sample = self._live.get(timeout=wait_s)
        except queue.Empty:
            return
        if sample is None:
            return
        key, payload = sample
        try:
            heard = _keyed_plan(key, payload)
        except InvalidInput as error:
            _log.warning("%s: ignored: %s", excerpt(key), error)
            return
        if heard.revision <= self._seen.get(heard.mission_id, 0):
            return  # published twice, once before and once after a crash of the service
        try:
            # The publication itself is not passed on: anyone may put one. What the service keeps is.
            self._fetch(heard.mission_id)
        except OxbowError as error:
            _log.warning("%s: cannot be compared with what is kept: %s", key, error)
            self._due_s = time.monotonic() + LOOK_S
            return
        if heard not in self._pending:
            _log.warning("%s: ignored: revision %d is not kept with that content", key, heard.revision)

    # ----------------------------------------------------------------- catching up

    def _is_due(self) -> bool:
        # While the link was down, nothing published was heard: ask at once.
        if self._links != self._bus.links:
            self._links, self._due_s = self._bus.links, 0.0
        return time.monotonic() >= self._due_s

    def _first_catch_up(self) -> None:
        give_up = time.monotonic() + ANSWER_S
        while True:
            try:
                self._catch_up()
            except Unavailable:  # the service may just be starting again
                if time.monotonic() > give_up:
                    raise
                time.sleep(LOOK_S)
            else:
                return

    def _try_to_catch_up(self) -> None:
        try:
            self._catch_up()
        except OxbowError as error:
            if not self._is_behind:
                _log.warning("%s: cannot ask what is kept, will try again: %s", self._key, error)
            self._is_behind, self._due_s = True, time.monotonic() + LOOK_S

    def _catch_up(self) -> None:
        """Fetch what was missed."""
        for status in self._statuses():
            mission_id, last = status.mission_id, _last_of(status)
            if last > max(self._seen.get(mission_id, 0), self._asked.get(mission_id, 0)):
                self._fetch(mission_id)
                self._asked[mission_id] = last
        self._is_behind, self._due_s = False, time.monotonic() + CATCH_UP_S

    def _fetch(self, mission_id: str) -> None:
        """Have what is kept of a mission beyond what was seen come next, by rising revision."""
        seen = self._seen.get(mission_id, 0)
        key = MissionKey(mission_id, self._key.what, ANY)
        found: dict[int, PlanUpdate] = {}
        for own_key, payload in self._ask(f"{key}?after={seen}"):
            try:
                update = _keyed_plan(own_key, payload)
            except InvalidInput as error:
                _log.warning("%s: ignored: %s", excerpt(own_key), error)
            else:
                found[update.revision] = update
        # Replies arrive in any order; revisions of a mission are seen in theirs.
        for revision in sorted(found):
            if revision > seen:
                self._pending.append(found[revision])
                self._seen[mission_id] = revision

    def _statuses(self) -> Iterator[MissionStatus]:
        asked = None if self._key.mission_id == ANY else self._key.mission_id
        for own_key, payload in self._ask(str(MissionKey(self._key.mission_id, "status"))):
            try:
                yield read_status(payload, asked)
            except InvalidInput as error:
                _log.warning("%s: ignored: %s", excerpt(own_key), error)

    def _ask(self, key: str) -> list[tuple[str, bytes]]:
        try:
            return self._bus.query(key, timeout_s=ANSWER_S)
        except InvalidInput:  # nothing of the kind is kept
            return []


def _last_of(status: MissionStatus) -> int:
    """The last revision of a mission that may have a plan by now."""
    return status.revision if status.state.is_final else status.revision - 1
