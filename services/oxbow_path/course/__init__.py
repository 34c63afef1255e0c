"""Courses: a shortest way, or a loop round islands, with detours; for what no walk round a tree serves well."""

from oxbow_path.course.planner import best_plan

__all__ = ["best_plan"]
