"""The compiled part: the command line, and the simulation behind `seixo.open`."""

from collections.abc import Sequence

__version__: str

def main(words: Sequence[str]) -> int:
    """Runs the program with `words` as its command line, its name first; returns the exit code."""

class Simulation:
    warnings: list[str]
    time: float
    steps: int
    processor: tuple[str, str]
    clock: tuple[float, float]
    def __init__(
        self,
        path: str | None,
        text: str | None,
        spacing: float | None,
        sets: Sequence[str],
        backend: str,
        adapter: str | None,
        threads: int | None,
    ) -> None: ...
    def step(self) -> tuple[float, int, float, bool, int]: ...
    def water(self) -> list[bytes]: ...
    def solids(
        self,
    ) -> list[
        tuple[
            str,
            bool,
            list[float],
            list[float],
            list[float],
            list[float],
            list[float],
            list[float],
        ]
    ]: ...
    def gauges(self) -> list[tuple[str, float]]: ...
    def monitor(self) -> list[tuple[str, float]]: ...
