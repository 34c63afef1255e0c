"""Plans accepted missions, several at a time, each in a helper process that asks the stages by way of this one."""

from __future__ import annotations

import logging
import math
import queue
import threading
import time
from collections.abc import Callable

import msgspec

from oxbow.bus.client import Bus, BusCall
from oxbow.bus.query import MSGPACK
from oxbow.contracts import STAGES, any_layer_key, layer_key
from oxbow.errors import DeadlineExceeded, ErrorReply, Internal, OxbowError, Unavailable, error_text
from oxbow.planning.submission import SubmissionParameters
from oxbow.runtime.closing import Closing
from oxbow_mission.fair import Turns
from oxbow_mission.helper import Helper, HelperDied, Helpers
from oxbow_mission.registry import Registry
from oxbow_mission.revision import QueuedMission
from oxbow_mission.vitals import Vitals
from oxbow_mission.wire import STAGE, Answer, Ask, Plan, Planned, Show

__all__ = ["Planner"]

MAX_ATTEMPTS = 3
"""A revision fails after this many planner processes died of it."""

GRACE_S = 5.0
"""How much longer than the deadline a run may take, so that a stage's own words about it arrive."""

END_S = 2.0
"""How long to wait for threads whose runs were stopped."""

_ENDPOINTS = {endpoint.stage: endpoint for endpoint in STAGES}
_log = logging.getLogger(__name__)


class Planner(Closing):
    """Threads that have planned what the registry has accepted, until it is closed.

    A stage that is missing is waited for until the mission's deadline: an accepted mission is not given up
    because a stage is being started again. Each replica of a stage is asked by one run at a time, and the clients
    whose missions wait for it take turns.

    Parameters
    ----------
    registry
        Where missions wait, and where their plans go.
    bus
        Reaches the stages.
    vitals
        Counts the runs.
    workers
        Missions planned at the same time.
    memory_mb
        What a helper process may take.
    on_failure
        Called when an outcome cannot be kept or published: this process should then be started anew.
    handler
        What the helper processes do, as ``package.module:attribute``.
    """

    def __init__(
        self,
        registry: Registry,
        bus: Bus,
        vitals: Vitals,
        workers: int,
        memory_mb: int,
        on_failure: Callable[[], None],
        handler: str = "oxbow_mission.run:plan",
    ) -> None:
        self.registry = registry
        self.bus = bus
        self.vitals = vitals
        self.helpers = Helpers(handler, memory_mb)
        self.on_failure = on_failure
        self.failed = False
        self.turns = Turns(lambda stage: len(bus.instances(stage)))
        bus.patience_s = math.inf  # the deadline alone ends a wait for a stage
        self._audience = bus.audience(any_layer_key(STAGE))
        # Daemons: a stage that does not answer must not keep this process from ending.
        self._threads = [
            threading.Thread(target=self._work, name=f"planner-{i}", daemon=True) for i in range(workers)
        ]
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """Stop what is being planned, which waits in the store for another time."""
        self.registry.close()
        self.helpers.close()
        give_up = time.monotonic() + END_S
        for thread in self._threads:
            thread.join(max(0.0, give_up - time.monotonic()))

    def _work(self) -> None:
        try:
            while (job := self.registry.claim()) is not None:
                started = time.monotonic()
                outcome = self._plan(job)
                self.vitals.count(time.monotonic() - started, failed=isinstance(outcome, OxbowError))
                self.registry.settle(job, outcome)
        except BaseException:  # noqa: BLE001 - a full disk, say; zenoh's panics are no Exception
            _log.exception("the planner ends")
            self.failed = True
            self.on_failure()

    def _plan(self, job: QueuedMission) -> bytes | OxbowError:
        """The plan, or why there is none; whatever is raised becomes an error."""
        try:
            with self.helpers.one() as helper:
                run = _Run(job, self, helper, shown=bool(self._audience))
                with self.registry.cancellable(job, run.cancel):
                    return run.planned()
        except OxbowError as error:
            return error
        except BaseException as error:  # noqa: BLE001 - becomes an `internal` error
            _log.exception("%s", job.revision)
            return Internal(error_text(error), where=STAGE)


class _Run:
    """One revision being planned by a helper process."""

    def __init__(self, job: QueuedMission, planner: Planner, helper: Helper, *, shown: bool) -> None:
        self.job = job
        self.planner = planner
        self.helper = helper
        self.shown = shown
        self.over = False
        parameters = msgspec.json.decode(job.request.parameters, type=SubmissionParameters)
        # Monotonic here, wall-clock time for the stages: only the latter means the same to another process.
        self.until = time.monotonic() + parameters.deadline_s + GRACE_S
        self._call = BusCall(
            planner.bus,
            mission_id=job.revision.mission_id,
            deadline_s=time.time() + parameters.deadline_s,
        )
        self._answers: queue.SimpleQueue[Answer] = queue.SimpleQueue()  # to what is being asked now

    def planned(self) -> bytes:
        """The completed Mission File; a helper that is killed from outside is replaced."""
        order = Plan(
            mission_id=self.job.revision.mission_id,
            revision=self.job.revision.number,
            run_id=self._call.run_id,
            document=self.job.request.document,
            parameters=self.job.request.parameters,
            show=self.shown,
        )
        # Again from the start after each death: a run leaves nothing behind that the next could go on with.
        while True:
            try:
                outcome = self.helper.carry_out(order, self.until - time.monotonic(), self._answer)
            except HelperDied as error:
                self._note_death(error)
            else:
                if isinstance(outcome, Planned):
                    return outcome.document
                raise _error_of(outcome)

    def cancel(self) -> None:
        """Stop; whatever a stage still does for this run is waited for by nobody."""
        self.over = True
        # Ends the wait in `_answer`; if none is under way, `over` is seen at the next question.
        self._answers.put(Answer(error=_STOPPED))
        # Whatever it computes is of no use any more, and it might hold on for minutes.
        self.helper.kill()

    def _note_death(self, error: HelperDied) -> None:
        if self.over:
            raise _STOPPED.error()
        _log.error("%s: %s", self.job.revision, error)
        # Only deaths of its own count: one that was killed from outside says nothing about the mission.
        if error.is_own_fault and self.planner.registry.store.note_death(self.job.revision) >= MAX_ATTEMPTS:
            raise Internal(f"{error.message}; {MAX_ATTEMPTS} of them did, each on this mission", where=STAGE)
        if time.monotonic() > self.until:
            raise DeadlineExceeded(error.message, where=STAGE)

    def _answer(self, said: Ask | Show) -> Answer | None:
        if self.over:
            raise _STOPPED.error()
        if isinstance(said, Show):
            key = layer_key(self.job.revision.mission_id, STAGE, said.name)
            self.planner.bus.publish(key, said.payload, encoding=MSGPACK, droppable=said.droppable)
            return None
        self.planner.registry.note_progress(self.job, said.stage, said.fraction)
        # On a thread of its own: a run that is cancelled does not wait for the stage, which works on all the same.
        answers = self._answers = queue.SimpleQueue()
        threading.Thread(target=self._ask, args=(said, answers), name=f"ask {said.stage}", daemon=True).start()
        return answers.get()

    def _ask(self, ask: Ask, answers: queue.SimpleQueue[Answer]) -> None:
        answer = Answer(error=_STOPPED)
        try:
            with self.planner.turns.turn(ask.stage, self.job.client, self._is_over) as granted:
                if granted:
                    self._call.origin = ask.origin
                    envelope = self._call.envelope(ask.part)
                    answer = Answer(payload=self.planner.bus.forward(_ENDPOINTS[ask.stage], ask.payload, envelope))
                elif not self.over:
                    late = DeadlineExceeded("no replica was free before the deadline", where=ask.stage)
                    answer = Answer(error=ErrorReply.of(late))
        except OxbowError as error:
            answer = Answer(error=ErrorReply.of(error))
        except BaseException as error:  # noqa: BLE001 - becomes an `internal` error
            _log.exception("%s: %s", self.job.revision, ask.stage)
            answer = Answer(error=ErrorReply.of(Internal(error_text(error), where=ask.stage)))
        finally:
            answers.put(answer)

    def _is_over(self) -> bool:
        return self.over or time.time() > self._call.deadline_s


_STOPPED = ErrorReply.of(Unavailable("the run was stopped", where=STAGE))


def _error_of(outcome: object) -> OxbowError:
    error = getattr(outcome, "error", None)
    if isinstance(error, ErrorReply):
        return error.error()
    return Internal(f"a helper process answered {type(outcome).__name__} to an order to plan", where=STAGE)
