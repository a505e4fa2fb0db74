"""What an import could not take as it stands: collected with prim paths, printed as one list."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum


class Kind(Enum):
    """Why an entry is in the list. The value is the heading under which it is printed."""

    UNSUPPORTED = "Not supported"
    LEFT_OUT = "Left out"
    WARNING = "Wrong in the stage"
    NOTE = "Chosen for you"


@dataclass(frozen=True)
class Entry:
    """One thing at one prim.

    Attributes:
        kind: why it is reported.
        path: the prim's path, or "" where the whole stage is meant.
        what: the thing.
        instead: what was used instead.
    """

    kind: Kind
    path: str
    what: str
    instead: str

    def __str__(self) -> str:
        place = f"{self.path}: " if self.path else ""
        return f"{place}{self.what}" + (f"; {self.instead}" if self.instead else "")


@dataclass
class Report:
    """The list. The same thing said twice of one prim is kept once."""

    entries: list[Entry] = field(default_factory=list)
    _seen: set[Entry] = field(default_factory=set, repr=False)

    def _add(self, kind: Kind, prim: object, what: str, instead: str) -> None:
        path = prim if isinstance(prim, str) else str(prim.GetPath())  # type: ignore[attr-defined]
        entry = Entry(kind, path, what, instead)
        if entry not in self._seen:
            self._seen.add(entry)
            self.entries.append(entry)

    def unsupported(self, prim: object, what: str, instead: str) -> None:
        """A feature that the renderer does not have. `prim` is a prim or a path."""
        self._add(Kind.UNSUPPORTED, prim, what, instead)

    def left_out(self, prim: object, what: str) -> None:
        """A prim that adds nothing to the picture, and why."""
        self._add(Kind.LEFT_OUT, prim, what, "")

    def warning(self, prim: object, what: str, instead: str) -> None:
        """Something wrong in the stage."""
        self._add(Kind.WARNING, prim, what, instead)

    def note(self, prim: object, what: str, instead: str) -> None:
        """A choice that was made where the stage says nothing."""
        self._add(Kind.NOTE, prim, what, instead)

    def of(self, kind: Kind) -> list[Entry]:
        """The entries of one kind, in the order they were found."""
        return [e for e in self.entries if e.kind is kind]

    def text(self, paths: int = 4) -> str:
        """The list for people: grouped by kind and by thing, with at most `paths` prims each."""
        lines = []
        for kind in Kind:
            groups: dict[tuple[str, str], list[str]] = {}
            for entry in self.of(kind):
                groups.setdefault((entry.what, entry.instead), []).append(entry.path)
            if groups:
                lines.append(f"{kind.value}:")
            for (what, instead), places in groups.items():
                shown = ", ".join(p for p in places[:paths] if p)
                more = f" and {len(places) - paths} more" if len(places) > paths else ""
                lines.append(f"  - {what}" + (f"; {instead}" if instead else ""))
                if shown:
                    lines.append(f"      {shown}{more}")
        return "\n".join(lines)
