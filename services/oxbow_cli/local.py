"""The stages in this process: what `--local` plans with."""

from __future__ import annotations

from oxbow.stage.local import Handler, LocalCall
from oxbow.wire.recording import Show, discard

__all__ = ["local_call"]


def local_call(show: Show = discard) -> LocalCall:
    """A call that runs each stage's handler here; the algorithms' imports are paid at this point."""
    import oxbow_assignment.service  # noqa: PLC0415
    import oxbow_certificate.service  # noqa: PLC0415
    import oxbow_contour.service  # noqa: PLC0415
    import oxbow_decomposition.service  # noqa: PLC0415
    import oxbow_path.service  # noqa: PLC0415

    handlers: dict[str, Handler] = {
        "contour": oxbow_contour.service.handle,
        "assignment": oxbow_assignment.service.handle,
        "decomposition": oxbow_decomposition.service.handle,
        "path": oxbow_path.service.handle,
        "certificate": oxbow_certificate.service.handle,
    }
    return LocalCall(handlers, show)
