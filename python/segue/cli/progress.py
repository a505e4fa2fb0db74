"""What a person sees while a picture is made: a bar on a terminal, elsewhere a line at times."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import Any

from ..reporting import error_text

#: Seconds between two lines where there is no terminal.
INTERVAL = 10.0


def clock(seconds: float | None) -> str:
    """Seconds as m:ss or h:mm:ss; a dash where they are not known."""
    if seconds is None or not seconds < 1e7:
        return "-:--"
    whole = round(seconds)
    hours, minutes, rest = whole // 3600, whole // 60 % 60, whole % 60
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


class Progress:
    """Shows the engine's progress reports on standard error.

    Args:
        title: what is being rendered.
        quiet: show nothing.
    """

    def __init__(self, title: str, quiet: bool) -> None:
        self._title = title
        self._quiet = quiet
        self._last = time.monotonic()
        self._bar: Any = None
        self._task: Any = None

    def __enter__(self) -> Progress:
        if self._quiet or not sys.stderr.isatty():
            return self
        from rich.console import Console
        from rich.progress import BarColumn, TextColumn
        from rich.progress import Progress as RichProgress

        self._bar = RichProgress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.percentage:>3.0f} %"),
            TextColumn("{task.fields[state]}"),
            console=Console(stderr=True),
        )
        self._bar.start()
        self._task = self._bar.add_task(self._title, total=1.0, state="")
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._bar is not None:
            self._bar.stop()

    def update(self, report: dict[str, Any]) -> None:
        """Shows one report of the engine."""
        if self._quiet:
            return
        if self._bar is None and time.monotonic() - self._last < INTERVAL:
            return
        self._last = time.monotonic()
        fraction = float(report.get("fraction") or 0.0)
        state = (
            f"{report.get('samples') or 0:g} samples  {clock(report.get('seconds'))} elapsed  "
            f"{clock(report.get('remaining'))} left  {error_text(report)}"
        )
        stage = report.get("stage")
        if stage and not report.get("samples"):
            state = str(stage)
        if self._bar is not None:
            self._bar.update(self._task, completed=fraction, state=state)
        else:
            print(f"{self._title}: {100 * fraction:.0f} %  {state}", file=sys.stderr)
