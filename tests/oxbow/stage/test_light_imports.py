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


def test_the_client_is_found_by_its_short_name():
    import oxbow
    from oxbow.client import Client

    assert oxbow.Client is Client
    with pytest.raises(AttributeError, match="'oxbow' has no attribute 'Klient'"):
        oxbow.Klient  # noqa: B018 - the access is what fails
