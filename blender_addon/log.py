"""What an export could not translate faithfully, said once each."""

from __future__ import annotations

import logging

logger = logging.getLogger("segue.blender")


class ExportLog:
    """Collects the warnings of one export, in the order of their first appearance."""

    def __init__(self) -> None:
        self._messages: dict[str, None] = {}
        self._told = 0

    def warn(self, message: str) -> None:
        """Note `message`; a repetition of an earlier one is dropped."""
        if message not in self._messages:
            self._messages[message] = None
            logger.warning("%s", message)

    def news(self) -> list[str]:
        """The warnings since the last call, or since the start."""
        messages = list(self._messages)[self._told :]
        self._told += len(messages)
        return messages
