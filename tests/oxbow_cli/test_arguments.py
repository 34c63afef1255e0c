"""What the command line gives, as what the library takes."""

import pytest

from oxbow_cli.arguments import replica_counts


@pytest.mark.parametrize(("processors", "planners"), [(1, 2), (2, 2), (3, 3), (16, 16), (None, 2)])
def test_there_is_a_path_process_per_processor_and_two_at_least(monkeypatch, processors, planners):
    monkeypatch.setattr("os.cpu_count", lambda: processors)
    assert replica_counts([]) == {"path": planners}
    assert replica_counts(["contour=3"]) == {"path": planners, "contour": 3}


def test_the_number_that_is_asked_for_is_kept(monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 8)
    assert replica_counts(["path=1"]) == {"path": 1}
    assert replica_counts(["path=1", "contour=2", "path=4"]) == {"path": 4, "contour": 2}
