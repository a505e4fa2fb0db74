"""Exit statuses, and which failure means which."""

from __future__ import annotations

from enum import IntEnum

from .. import errors
from .._library import LibraryError
from ..images import ImageError


class Status(IntEnum):
    """Exit status of the command."""

    DONE = 0
    FAILED = 1
    BAD_USAGE = 2
    BAD_INPUT = 3
    REFUSED = 4
    CANCELLED = 130


class UsageError(Exception):
    """The options contradict each other or cannot be used."""


class InputError(Exception):
    """A file that was named cannot be used."""


BAD_USAGE = int(Status.BAD_USAGE)


def status_of(error: Exception) -> Status | None:
    """The exit status of a failure that is said in one line; None for a defect of ours."""
    if isinstance(error, (UsageError, errors.BadArgumentError)):
        return Status.BAD_USAGE
    if isinstance(error, (LibraryError, errors.InternalError, errors.OutputError)):
        return Status.FAILED
    if isinstance(error, (InputError, ImageError, errors.SegueError)):
        return Status.BAD_INPUT
    if isinstance(error, ImportError):
        return Status.FAILED
    return None
