"""Processor time, in scripts that run in the environments of other renderers."""

from __future__ import annotations

import resource


def processor_seconds() -> float:
    """Of this process."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime
