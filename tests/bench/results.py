"""What a bench found: a table of figures, and goals met or missed."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from statistics import median

from rich.console import Console
from rich.table import Table

__all__ = ["Figure", "Goal", "Section", "keep", "middle", "show"]

Figure = float | str


@dataclass(frozen=True)
class Goal:
    """A figure that should not be above `at_most`, or not be below `at_least`."""

    what: str
    figure: float
    unit: str = ""
    at_most: float | None = None
    at_least: float | None = None

    @property
    def is_met(self) -> bool:
        above = self.at_most is not None and self.figure > self.at_most
        below = self.at_least is not None and self.figure < self.at_least
        return not (above or below)

    def __str__(self) -> str:
        limit = f"<= {self.at_most:g}" if self.at_most is not None else f">= {self.at_least:g}"
        met = "met" if self.is_met else "MISSED"
        return f"{met}: {self.what} {self.figure:.4g}{self.unit} (goal {limit}{self.unit})"


@dataclass(frozen=True)
class Section:
    """The rows of one table, all with the same columns."""

    title: str
    rows: Sequence[dict[str, Figure]]
    goals: Sequence[Goal] = field(default_factory=tuple)
    note: str = ""


def show(section: Section, console: Console) -> None:
    """Print a section as a table, with its goals below."""
    table = Table(title=section.title, title_justify="left")
    for number, name in enumerate(section.rows[0] if section.rows else ()):
        table.add_column(
            name, justify="left" if number == 0 and isinstance(section.rows[0][name], str) else "right"
        )
    for row in section.rows:
        table.add_row(*map(_cell, row.values()))
    console.print(table)
    for goal in section.goals:
        console.print(f"  {goal}", style="green" if goal.is_met else "bold red", highlight=False)
    if section.note:
        console.print(f"  {section.note}", style="dim", highlight=False)
    console.print()


def _cell(figure: Figure) -> str:
    if isinstance(figure, str):
        return figure
    return f"{figure:,}" if isinstance(figure, int) else f"{figure:.3g}"


def keep(sections: dict[str, list[Section]], file: Path) -> None:
    """Write sections as JSON beside those that the file has of other runs."""
    kept = json.loads(file.read_text()) if file.is_file() else {}
    load = os.getloadavg()[0]
    for name, tables in sections.items():
        kept[name] = {
            "machine": {"cores": os.cpu_count(), "load": load, "python": platform.python_version()},
            "tables": [
                asdict(table) | {"goals": [asdict(goal) | {"is_met": goal.is_met} for goal in table.goals]}
                for table in tables
            ],
        }
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(kept, indent=2, allow_nan=False) + "\n")


def middle(rows: Sequence[dict[str, Figure]], column: str) -> float:
    """The median of a column."""
    return median(figure for row in rows if not isinstance(figure := row[column], str))
