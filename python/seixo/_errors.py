"""What the program reports with its exit codes, as exceptions."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ._results import Run


class SeixoError(Exception):
    """The program ended with an error; its text is the program's message."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        #: Exit code of the program.
        self.code = code
        #: What the run left, if it left anything.
        self.run: Run | None = None


class CaseError(SeixoError):
    """The case or an option is wrong (exit code 2)."""


class DeviceError(SeixoError):
    """No suitable GPU, or the device was lost (exit code 3)."""


class DivergedError(SeixoError):
    """The computation diverged, or its result means nothing (exit code 4)."""


class FileError(SeixoError):
    """A file could not be read or written (exit code 5)."""


KINDS: dict[int, type[SeixoError]] = {2: CaseError, 3: DeviceError, 4: DivergedError, 5: FileError}


def error(message: str, code: int) -> SeixoError:
    """The exception of an exit code."""
    words = message.strip().removeprefix("error: ")
    return KINDS.get(code, SeixoError)(words or f"seixo ended with exit code {code}", code)
