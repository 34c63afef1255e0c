"""Plans accepted missions, a few at a time: the pipeline over the bus, watched."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable
from typing import TypeVar

import msgspec
from shapely import Point

from oxbow import codec
from oxbow.bus import Bus, BusCall
from oxbow.bus.query import MSGPACK
from oxbow.contracts import Endpoint, Message, any_layer_key, layer_key
from oxbow.errors import Internal, OxbowError, Unavailable
from oxbow.mission import Mission, mission_json, parse_mission
from oxbow.pipeline import expected_calls, plan_mission
from oxbow.recording import Layer, LayerKind, Stamped
from oxbow.site import Site
from oxbow.submission import SubmissionParameters
from oxbow_mission.registry import Registry
from oxbow_mission.store import Job, Revision
from oxbow_mission.vitals import Vitals

__all__ = ["Planner"]

Q = TypeVar("Q", bound=Message)
R = TypeVar("R", bound=Message)

STAGE = "mission"
_log = logging.getLogger(__name__)


class Planner:
    """Threads that plan what the registry has accepted, until it is closed.

    A stage that is missing is waited for until the mission's deadline: an accepted mission is not given up
    because a stage is being started again.

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
    on_failure
        Called when an outcome cannot be kept or published: this process had better start anew.
    """

    def __init__(
        self, registry: Registry, bus: Bus, vitals: Vitals, workers: int, on_failure: Callable[[], None]
    ) -> None:
        self.registry = registry
        self.bus = bus
        self.vitals = vitals
        self.on_failure = on_failure
        self.failed = False
        bus.patience_s = math.inf
        self._audience = bus.audience(any_layer_key(STAGE))
        # Daemons: a stage that does not answer must not keep this process from ending.
        self._threads = [
            threading.Thread(target=self._work, name=f"planner-{i}", daemon=True) for i in range(workers)
        ]
        for thread in self._threads:
            thread.start()

    def _work(self) -> None:
        try:
            while (job := self.registry.claim()) is not None:
                started = time.monotonic()
                outcome = self._plan(job)
                self.vitals.count(time.monotonic() - started, failed=isinstance(outcome, OxbowError))
                self.registry.settle(job, outcome)
        except Exception:  # noqa: BLE001 - a full disk, say
            _log.exception("the planner ends")
            self.failed = True
            self.on_failure()

    def _plan(self, job: Job) -> bytes | OxbowError:
        """The plan, or why there is none; here an unknown exception becomes an `internal` error."""
        try:
            return _Run(job, self.registry, self.bus, shown=bool(self._audience)).plan()
        except OxbowError as error:
            return error
        except Exception as error:  # noqa: BLE001 - becomes an `internal` error
            _log.exception("mission %s, revision %d", job.revision.mission_id, job.revision.number)
            return Internal(f"{type(error).__name__}: {error}", where=STAGE)


class _Run:
    """One run of the pipeline for one revision of a mission."""

    def __init__(self, job: Job, registry: Registry, bus: Bus, *, shown: bool) -> None:
        self.job = job
        self.registry = registry
        self.shown = shown
        self.parameters = msgspec.json.decode(job.request.parameters, type=SubmissionParameters)
        self.mission = parse_mission(job.request.document)
        self.site = Site.of(self.mission)
        self.seconds: dict[str, float] = {}
        self.calls, self.expected_calls = 0, expected_calls(self.mission)
        self._call = BusCall(
            bus,
            mission_id=job.revision.mission_id,
            origin=(self.site.frame.lat, self.site.frame.long),
            deadline_s=time.time() + self.parameters.deadline_s,
        )

    def plan(self) -> bytes:
        """The completed Mission File, with the id and the revision that it is kept under."""
        self._show(_site_layer(self.site), droppable=True)
        try:
            mission = plan_mission(self.mission, self.parameters, call=self)
        except OxbowError as error:
            self._show_outcome("failed", str(error))
            raise
        self._show_outcome("done", f"planned in {sum(self.seconds.values()):.2f} s")
        return mission_json(_stamped(mission, self.job.revision))

    def __call__(self, endpoint: Endpoint[Q, R], request: Q, /, *, part: str = "") -> R:
        """Call a stage, and tell that it is at work."""
        if self.registry.closed:
            raise Unavailable("the service stops; the mission goes on another time", where=STAGE)
        fraction = min(self.calls / self.expected_calls, 1.0)
        self.registry.note_progress(self.job, endpoint.stage, fraction)
        self.calls += 1
        started = time.monotonic()
        try:
            return self._call(endpoint, request, part=part)
        finally:
            name = f"{endpoint.stage}_s"
            self.seconds[name] = self.seconds.get(name, 0.0) + time.monotonic() - started

    def _show_outcome(self, name: str, text: str) -> None:
        # Not droppable: it tells the recorder that nothing more will come.
        layer = Layer(stage=STAGE, name=name, kind=LayerKind.LOG, text=text, scalars=self.seconds)
        self._show(layer, droppable=False)

    def _show(self, layer: Layer, *, droppable: bool) -> None:
        if not self.shown:
            return
        stamped = Stamped(
            mission_id=self.job.revision.mission_id,
            origin=self._call.origin,
            request_id=self._call.run_id,
            time_s=time.time(),
            layer=layer,
        )
        key = layer_key(self.job.revision.mission_id, STAGE, layer.name)
        self._call.bus.publish(key, codec.encode(stamped), encoding=MSGPACK, droppable=droppable)


def _site_layer(site: Site) -> Layer:
    zones = ("forbidden zone",) * len(site.zones)
    places = {"launch": site.launch, "recovery": site.recovery}
    for vehicle in (member.vehicle for member in site.members if member.is_named):
        places |= {f"{vehicle.name}: start": vehicle.start, f"{vehicle.name}: recovery": vehicle.recovery}
    names, ends = places.keys(), map(Point, places.values())
    return Layer(
        stage=STAGE,
        name="site",
        geometries=(site.outline, *site.zones, *ends, *(spot.area for spot in site.hot_spots)),
        labels=("outline", *zones, *names, *(spot.name for spot in site.hot_spots)),
    )


def _stamped(mission: Mission, revision: Revision) -> Mission:
    assert mission.plan is not None
    plan = msgspec.structs.replace(mission.plan, mission_id=revision.mission_id, revision=revision.number)
    return msgspec.structs.replace(mission, plan=plan)
