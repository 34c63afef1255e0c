"""What every way to call a stage keeps to: in this process, and over the bus."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator

import pytest
import shapely

from oxbow.bus.client import Bus, BusCall
from oxbow.bus.router import RouterProcess
from oxbow.contracts import ANY_LAYER, Call
from oxbow.errors import Infeasible, InvalidMission, OxbowError
from oxbow.stage.local import LocalCall
from oxbow.wire import codec
from oxbow.wire.recording import Layer, Stamped
from tests.support.bus_processes import end, launch, wait_until
from tests.support.echo_stage import ECHO, SQUARE, Deed, EchoRequest, handle

pytestmark = pytest.mark.processes


@pytest.fixture(scope="module")
def replica(router: RouterProcess, bus: Bus) -> Iterator[None]:
    process = launch(router.endpoint, "one")
    wait_until(lambda: bus.instances("echo"))
    yield
    end(process)


@pytest.fixture
def shown() -> list[Layer]:
    return []


@pytest.fixture(params=["local", "bus"])
def either_call(request: pytest.FixtureRequest, shown: list[Layer]) -> Iterator[Call]:
    """A call whose layers arrive in `shown`."""
    if request.param == "local":
        yield LocalCall({"echo": handle}, shown.append)
        return
    request.getfixturevalue("replica")
    bus: Bus = request.getfixturevalue("bus")
    layers = bus.subscribe(ANY_LAYER, lambda _key, data: shown.append(codec.decode(data, Stamped).layer))
    yield BusCall(bus, mission_id="m1", deadline_s=time.time() + 30.0)
    layers.close()


def test_a_reply_comes_back_with_its_geometry(either_call: Call) -> None:
    island = shapely.Polygon(SQUARE.exterior, [shapely.box(0.1, 0.1, 1 / 3, 0.9).exterior])
    reply = either_call(ECHO, EchoRequest(text="één", shape=island))
    assert reply.text == "één"
    assert shapely.equals_exact(reply.shape, island, tolerance=0.0)


@pytest.mark.parametrize(
    ("deed", "kind", "where", "message"),
    [
        (Deed.REFUSE, InvalidMission, "text", "is wrong; expected something right"),
        (Deed.GIVE_UP, Infeasible, "echo", "no water is left"),
    ],
)
def test_an_error_keeps_its_kind_message_and_place(
    either_call: Call, deed: Deed, kind: type[OxbowError], where: str, message: str
) -> None:
    with pytest.raises(OxbowError) as caught:
        either_call(ECHO, EchoRequest(shape=SQUARE, deed=deed))
    assert type(caught.value) is kind
    assert (caught.value.where, caught.value.message) == (where, message)


@pytest.mark.parametrize("deed", [Deed.BREAK, Deed.LIE])
def test_a_fault_of_the_handler_never_passes_for_a_reply(either_call: Call, deed: Deed) -> None:
    with pytest.raises((OxbowError, ZeroDivisionError, TypeError), match=r"fault of the handler|replied a str"):
        either_call(ECHO, EchoRequest(shape=SQUARE, deed=deed))


def test_layers_arrive_in_order(either_call: Call, shown: list[Layer]) -> None:
    either_call(ECHO, EchoRequest(shape=SQUARE, deed=Deed.SHOW))
    wait_until(lambda: len(shown) == 3)
    assert [(layer.stage, layer.name, layer.step) for layer in shown] == [("echo", "shape", i) for i in range(3)]
    assert all(layer.geometries[0].equals(SQUARE) for layer in shown)


@pytest.mark.usefixtures("replica")
def test_the_handler_runs_in_a_process_of_its_own_over_the_bus(call: BusCall) -> None:
    assert call(ECHO, EchoRequest(shape=SQUARE)).pid != os.getpid()


@pytest.mark.usefixtures("replica")
def test_layers_are_stamped_with_their_mission_run_and_origin(bus: Bus, call: BusCall) -> None:
    arrived: list[tuple[str, Stamped]] = []
    with_key = bus.subscribe(ANY_LAYER, lambda key, data: arrived.append((key, codec.decode(data, Stamped))))
    call(ECHO, EchoRequest(shape=SQUARE, deed=Deed.SHOW))
    wait_until(lambda: len(arrived) == 3)
    with_key.close()
    key, stamped = arrived[0]
    assert key == "oxbow/v1/layer/m1/echo/shape"
    assert (stamped.mission_id, stamped.origin) == ("m1", (43.5, 5.2))
    assert {stamped.request_id for _, stamped in arrived} == {call.run_id}


@pytest.mark.usefixtures("replica")
def test_nothing_is_shown_without_a_mission(bus: Bus) -> None:
    arrived: list[str] = []
    layers = bus.subscribe(ANY_LAYER, lambda key, _data: arrived.append(key))
    nameless = BusCall(bus, deadline_s=time.time() + 30.0)
    named = BusCall(bus, mission_id="named", deadline_s=time.time() + 30.0)
    nameless(ECHO, EchoRequest(shape=SQUARE, deed=Deed.SHOW))
    named(ECHO, EchoRequest(shape=SQUARE, deed=Deed.SHOW))
    wait_until(lambda: len(arrived) == 3)
    layers.close()
    assert set(arrived) == {"oxbow/v1/layer/named/echo/shape"}
