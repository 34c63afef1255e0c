"""This tree against another revision: CPU and quality of the same plans, one after the other, in one run.

The other revision is checked out and installed in a folder of its own, with the same dependencies. Each plan is
one `oxbow plan --local`, the two trees in turn, so that what else the machine does slows both. CPU time counts,
not the clock; quality is judged by this tree's certificate for both.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from oxbow.contracts import Method
from oxbow.mission.file import read_mission
from oxbow_cli.evaluation import Evaluation, evaluate
from tests.bench.results import Figure, Goal, Section, middle
from tests.support.project import EXAMPLES, ROOT
from tests.support.real_lakes import MISSIONS

__all__ = ["measure_against"]

MOST_CPU = 1.0
WORSE = 1.02
"""The greatest ratio of q and p95 on any lake that still counts as no worse."""


@dataclass(frozen=True)
class Plan:
    """What one plan cost, how good it is, and where it leads."""

    cpu_s: float
    judged: Evaluation
    waypoints: object


def measure_against(revision: str) -> Iterator[Section]:
    """A table per method, of real lakes where there are some and of the project's survey otherwise.

    Parameters
    ----------
    revision
        What git calls the other revision.

    Yields
    ------
    Section
        With ratios below 1 where this tree is better.
    """
    files = MISSIONS or [EXAMPLES / "lake.json", EXAMPLES / "meander.json"]
    with _installed(revision) as other, tempfile.TemporaryDirectory() as scratch:
        for method in Method:
            out = Path(scratch) / "plan.json"
            rows = [
                _row(file, _planned(other, file, method, out), _planned(Path(sys.executable), file, method, out))
                for file in files
            ]
            yield Section(f"Against {revision}: {method}", rows, list(_goals(rows)))


@contextmanager
def _installed(revision: str) -> Iterator[Path]:
    """The Python of a clone of a revision, installed beside it; both are removed at the end."""
    with tempfile.TemporaryDirectory() as folder:
        # A clone, not a worktree, which would be registered in this repository however the run ends.
        tree = Path(folder) / "tree"
        _run("git", "clone", "--quiet", "--no-checkout", str(ROOT), str(tree))
        _run("git", "-C", str(tree), "checkout", "--quiet", _commit(revision))
        _run(sys.executable, "-m", "venv", str(tree / ".venv"))
        python = tree / ".venv/bin/python"
        install = (str(python), "-m", "pip", "install", "--quiet")
        _run(*install, *_dependencies())
        _run(*install, "--no-build-isolation", "--no-deps", "--editable", str(tree))
        yield python


def _commit(revision: str) -> str:
    """The commit that this repository knows by a name: a clone need not have the name."""
    return _run("git", "-C", str(ROOT), "rev-parse", "--verify", f"{revision}^{{commit}}").strip()


def _dependencies() -> list[str]:
    """The very versions that this tree runs with: the two are to differ in their own code alone."""
    frozen = _run(sys.executable, "-m", "pip", "freeze", "--exclude-editable").splitlines()
    return [line for line in frozen if "==" in line]


def _run(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def _planned(python: Path, file: Path, method: Method, out: Path) -> Plan:
    command = [str(python.parent / "oxbow"), "plan", str(file), "--local", "--method", method, "-o", str(out)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    _run(*command)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    mission = read_mission(out)
    out.unlink()
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Plan(cpu_s, evaluate(mission), mission.planned_paths)


def _row(file: Path, then: Plan, now: Plan) -> dict[str, Figure]:
    return {
        "mission": file.stem,
        "CPU then, s": then.cpu_s,
        "CPU now, s": now.cpu_s,
        "CPU": now.cpu_s / then.cpu_s,
        "q then": then.judged.q,
        "q now": now.judged.q,
        "q": now.judged.q / then.judged.q,
        "p95": now.judged.p95_ratio / then.judged.p95_ratio,
        "path": "same" if now.waypoints == then.waypoints else "another",
    }


def _goals(rows: Sequence[dict[str, Figure]]) -> Iterator[Goal]:
    yield Goal("CPU, median ratio", middle(rows, "CPU"), at_most=MOST_CPU)
    for name in ("q", "p95"):
        yield Goal(f"{name}, worst ratio", max(float(row[name]) for row in rows), at_most=WORSE)
