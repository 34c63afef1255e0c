"""docs/bus.md says what the contracts say."""

from __future__ import annotations

import importlib
import re

import msgspec
import pytest

from oxbow import contracts
from oxbow.contracts import Message
from tests.support.project import DOCS


@pytest.fixture(scope="module")
def committed() -> str:
    return (DOCS / "bus.md").read_text(encoding="utf-8")


def test_the_page_is_up_to_date(committed: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(DOCS)
    module = importlib.import_module("make_bus_md")
    assert module.bus_md() == committed, "run `python docs/make_bus_md.py`"


def test_every_message_is_explained_with_all_its_fields(committed: str) -> None:
    sent = [kind for kind in vars(contracts).values() if isinstance(kind, type) and issubclass(kind, Message)]
    for kind in sent:
        if kind.__subclasses__():
            continue
        _, _, section = committed.partition(f"# {kind.__name__}\n")
        fields = set(re.findall(r"^\| `(\w+)` \|", section.partition("\n#")[0], flags=re.MULTILINE))
        assert fields == {field.encode_name for field in msgspec.structs.fields(kind)}, kind.__name__


def test_examples_are_json(committed: str) -> None:
    examples = re.findall(r"```json\n(.*?)```", committed, flags=re.DOTALL)
    assert len(examples) > 10
    for example in examples:
        assert isinstance(msgspec.json.decode(example), dict)
