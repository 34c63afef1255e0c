"""What a planning helper process does: it runs the pipeline for one revision of a mission."""

from __future__ import annotations

import time
from typing import TypeVar

import msgspec
from shapely import Point

from oxbow.contracts import Endpoint, Message
from oxbow.errors import Internal, InvalidInput, OxbowError
from oxbow.mission.file import mission_json, parse_mission
from oxbow.planning.pipeline import expected_calls, plan_mission
from oxbow.planning.submission import SubmissionParameters
from oxbow.site.site import Site
from oxbow.wire import codec
from oxbow.wire.recording import Layer, LayerKind, Stamped
from oxbow_mission.peer import Peer
from oxbow_mission.wire import STAGE, Ask, FromHelper, Plan, Planned, Show, ToHelper

__all__ = ["plan"]

Q = TypeVar("Q", bound=Message)
R = TypeVar("R", bound=Message)

MOST_WRONG = 3
"""Replies to one request that are no answers, before it is given up."""


def plan(order: ToHelper, peer: Peer) -> FromHelper:
    """Plan a revision of a mission.

    Parameters
    ----------
    order
        A `Plan`.
    peer
        The mission service, by way of which the stages are asked.

    Returns
    -------
    Planned
        The completed Mission File.

    Raises
    ------
    OxbowError
        Why there is no plan.
    """
    assert isinstance(order, Plan)
    return Run(order, peer).planned()


class Run:
    """One run of the pipeline for one revision of a mission.

    Parameters
    ----------
    order
        What to plan.
    peer
        The mission service, which has the bus: it shows layers, and asks stages.
    """

    def __init__(self, order: Plan, peer: Peer) -> None:
        self.order = order
        self.peer = peer
        self.parameters = msgspec.json.decode(order.parameters, type=SubmissionParameters)
        self.mission = parse_mission(order.document)
        self.site = Site.of(self.mission)
        self.origin = (self.site.frame.lat, self.site.frame.long)
        self.seconds: dict[str, float] = {}
        self.calls, self.expected_calls = 0, expected_calls(self.site)

    def planned(self) -> Planned:
        """The completed Mission File, with the id and the revision that it is kept under."""
        self._show(_site_layer(self.site), droppable=True)
        try:
            mission = plan_mission(self.mission, self.parameters, call=self, site=self.site)
        except OxbowError as error:
            self._show_outcome("failed", str(error))
            raise
        self._show_outcome("done", f"planned in {sum(self.seconds.values()):.2f} s")
        assert mission.plan is not None
        plan = msgspec.structs.replace(
            mission.plan, mission_id=self.order.mission_id, revision=self.order.revision
        )
        return Planned(document=mission_json(msgspec.structs.replace(mission, plan=plan)))

    def __call__(self, endpoint: Endpoint[Q, R], request: Q, /, *, part: str = "") -> R:
        """Call a stage (`oxbow.contracts.Call`)."""
        # What is expected is an estimate: more calls than that must not make the share exceed 1.
        fraction = min(self.calls / self.expected_calls, 1.0)
        self.calls += 1
        started = time.monotonic()
        ask = Ask(
            stage=endpoint.stage,
            payload=codec.encode(request),
            part=part,
            fraction=fraction,
            origin=self.origin,
        )
        try:
            return self._reply(ask, endpoint)
        finally:
            name = f"{endpoint.stage}_s"
            self.seconds[name] = self.seconds.get(name, 0.0) + time.monotonic() - started

    def _reply(self, ask: Ask, endpoint: Endpoint[Q, R]) -> R:
        """What a stage replies; a replica that replies what is no answer is one to pass over."""
        # The bus asks the replica with the fewest requests: asked again, another one may answer.
        for _ in range(MOST_WRONG):
            answer = self.peer.ask(ask)
            if answer.error is not None:
                raise answer.error.error()
            try:
                return codec.decode(answer.payload, endpoint.reply)
            except InvalidInput as error:
                wrong = error
        raise Internal(f"sent an invalid reply {MOST_WRONG} times: {wrong}", where=endpoint.stage)

    def _show_outcome(self, name: str, text: str) -> None:
        # Not droppable: the recorder finishes the recording when this layer comes.
        layer = Layer(stage=STAGE, name=name, kind=LayerKind.LOG, text=text, scalars=self.seconds)
        self._show(layer, droppable=False)

    def _show(self, layer: Layer, *, droppable: bool) -> None:
        if not self.order.show:
            return
        stamped = Stamped(
            mission_id=self.order.mission_id,
            origin=self.origin,
            request_id=self.order.run_id,
            time_s=time.time(),
            layer=layer,
        )
        self.peer.send(Show(name=layer.name, payload=codec.encode(stamped), droppable=droppable))


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
