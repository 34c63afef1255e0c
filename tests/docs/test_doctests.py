"""Examples in docstrings run, and give what they say."""

import doctest
import importlib

import pytest

MODULES = [
    "oxbow.geometry.route",
    "oxbow.planning.pipeline",
    "oxbow_certificate.certify",
]


@pytest.mark.parametrize("name", MODULES)
def test_the_examples_of_a_module_hold(name):
    outcome = doctest.testmod(importlib.import_module(name), verbose=False)
    assert outcome.attempted > 0, "has no examples"
    assert outcome.failed == 0, "see the output"
