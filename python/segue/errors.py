"""The engine's failures as exceptions, one class for each status code of the C ABI."""

from __future__ import annotations


class SegueError(Exception):
    """A call into the engine failed. The text is the engine's own."""

    #: Status code of the C ABI (`segue_status`), or None where no call was made.
    status: int | None = None


class BadArgumentError(SegueError, ValueError):
    """A wrong size, a wrong type, an unknown key or malformed JSON."""

    status = 1


class BadSceneError(SegueError, ValueError):
    """The scene's data are wrong; the text names the object."""

    status = 2


class InternalError(SegueError, RuntimeError):
    """A defect of the engine, caught at its border."""

    status = 3


class CancelledError(SegueError):
    """The render was cancelled; what was rendered so far is readable."""

    status = 4


class OutputError(SegueError, OSError):
    """A file could not be written."""

    status = 5


_BY_STATUS: dict[int, type[SegueError]] = {
    c.status: c
    for c in (BadArgumentError, BadSceneError, InternalError, CancelledError, OutputError)
}


def from_status(status: int, text: str) -> SegueError:
    """The exception for a status other than 0."""
    return _BY_STATUS.get(status, SegueError)(text or f"the engine failed with status {status}")
