"""All cases, in the order of the report."""

from __future__ import annotations

import inputs
import ranges
import stiff
import surfaces

__all__ = ["inputs", "ranges", "stiff", "surfaces"]
