"""What all tests have in common."""

import signal

import hypothesis
import pytest

# The same examples on any day and machine, however long one takes: a failure is of the change, and comes again.
hypothesis.settings.register_profile("same", derandomize=True, deadline=None)
hypothesis.settings.load_profile("same")


@pytest.fixture(scope="session", autouse=True)
def heard_interrupts() -> None:
    """SIGINT as a terminal sends it: what shells start in the background ignores it, as would all its children."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
