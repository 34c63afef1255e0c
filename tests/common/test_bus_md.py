"""docs/bus.md says what the contracts say."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import msgspec
import pytest

from oxbow import contracts
from oxbow.contracts import Message

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def committed() -> str:
    return (DOCS / "bus.md").read_text(encoding="utf-8")


def test_the_page_is_up_to_date(committed: str) -> None:
    spec = importlib.util.spec_from_file_location("make_bus_md", DOCS / "make_bus_md.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
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
