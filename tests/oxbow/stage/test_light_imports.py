"""The router and the sessions of stages start at once, and stay small: they load no library of geometry."""

import subprocess
import sys

import pytest

HEAVY = {"numpy", "shapely", "pyproj", "scipy"}
STAGES = ("contour", "decomposition", "path", "assignment", "certificate")


@pytest.mark.parametrize(
    "modules",
    [
        pytest.param(("oxbow.bus.router",), id="router"),
        # A worker loads what its handler needs itself, once its memory is limited.
        pytest.param(("oxbow.stage.process",), id="worker before its handler"),
        pytest.param(tuple(f"oxbow_{stage}.__main__" for stage in STAGES), id="sessions of stages"),
    ],
)
def test_a_process_that_forwards_bytes_loads_no_library_of_geometry(modules):
    program = f"import sys, {', '.join(modules)}; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert HEAVY.isdisjoint(loaded.stdout.split())


@pytest.mark.parametrize(
    ("program", "spared"),
    [
        # A quarter of a second to load for a few lines of arithmetic, and as long for what only fleets need.
        pytest.param(
            "from importlib import import_module; [import_module(f'oxbow_{stage}.service') for stage in STAGES]",
            {"scipy.stats", "matplotlib", "rerun"},
            id="stages",
        ),
        pytest.param(
            "import oxbow_cli.planning; from oxbow_cli.local import local_call; local_call()",
            {"oxbow_assignment.service", "scipy.optimize", "matplotlib", "rerun"},
            id="a survey in one process",
        ),
    ],
)
def test_planning_loads_no_library_that_it_can_do_without(program, spared):
    program = f"import sys; STAGES = {STAGES}; {program}; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert spared.isdisjoint(loaded.stdout.split())


def test_the_client_is_found_by_its_short_name():
    import oxbow
    from oxbow.client import Client

    assert oxbow.Client is Client
    with pytest.raises(AttributeError, match="'oxbow' has no attribute 'Klient'"):
        oxbow.Klient  # noqa: B018 - the access is what fails
