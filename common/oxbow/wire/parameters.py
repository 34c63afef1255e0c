"""The parameters of a query on the bus, ``?name=value;...``, which are text."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from urllib.parse import unquote

from oxbow.errors import InvalidRequest
from oxbow.ids import excerpt

__all__ = ["parameters_of", "require_known"]

RESERVED = "_"
"""Zenoh keeps names that begin like this for itself, and may add some to any query."""


def parameters_of(text: str) -> dict[str, str]:
    """The parameters of a query, by name, without Zenoh's own.

    Parameters
    ----------
    text
        As they travel: ``name=value`` separated by semicolons, both percent-encoded.

    Raises
    ------
    InvalidRequest
        One is given twice; names it.
    """
    parameters: dict[str, str] = {}
    for pair in text.split(";"):
        name, _, value = map(unquote, pair.partition("="))
        if not pair or name.startswith(RESERVED):
            continue
        # Neither could be preferred without dropping the other silently.
        if name in parameters:
            raise InvalidRequest(f"has {excerpt(name)} twice; expected each name once", where="parameters")
        parameters[name] = value
    return parameters


def require_known(parameters: Iterable[str], accepted: Collection[str]) -> None:
    """Check that a query has no parameter but those that are accepted.

    Parameters
    ----------
    parameters
        The names of those that the query has.
    accepted
        The names that may be among them.

    Raises
    ------
    InvalidRequest
        One is not accepted; names it, and all that are.
    """
    for name in parameters:
        if name not in accepted:
            expected = f"{', '.join(accepted)} and nothing else" if accepted else "none"
            raise InvalidRequest(f"has {excerpt(name)}; expected {expected}", where="parameters")
