"""All cases, in the order of the report."""

from __future__ import annotations

import gallery
import inputs
import ranges
import stiff
import surfaces
import sweeps

__all__ = ["gallery", "inputs", "ranges", "stiff", "surfaces", "sweeps"]
