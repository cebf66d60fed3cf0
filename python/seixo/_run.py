"""Starts the program."""

from __future__ import annotations

import datetime
import decimal
import json
import numbers
import operator
import os
import subprocess
import sys
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Union

import tomli_w

from ._errors import DivergedError, error
from ._program import program
from ._results import Run, read

#: A case: its file, or what such a file would hold.
Case = Union[str, "os.PathLike[str]", Mapping[str, Any]]

#: Stopped with its state saved, to be resumed: no error.
RESUMABLE = 75


def run(
    case: Case,
    out: str | os.PathLike[str] | None = None,
    *,
    spacing: float | None = None,
    until: float | None = None,
    set: Mapping[str, Any] | None = None,  # noqa: A002, the option's name
    steps: int | None = None,
    backend: str | None = None,
    adapter: str | int | None = None,
    threads: int | None = None,
    max_wall: str | float | datetime.timedelta | None = None,
    memory_limit: str | int | None = None,
    picture: bool = False,
    force: bool = False,
    resume: bool = False,
    force_disk: bool = False,
    progress: bool = False,
) -> Run:
    """Runs a case and returns its results; returns when the run has ended.

    case: a TOML file, or a dict with the same keys. Paths in a dict count from the working directory.
    out: folder of the results; `out/NAME`, or `out/stdin` for a dict, if absent.
    set: values of the case to change, e.g. `{"fluid.preset": "paper", "body.0.density": 800}`.
    progress: show the program's progress and remarks on stderr.
    Everything else is the option of `seixo run` of the same name.

    A run that `max_wall` stopped is returned with the state saved; call again with `resume=True`.

    Raises CaseError, DeviceError, DivergedError or FileError with the program's message. KeyboardInterrupt is passed on
    after the program has saved its state.
    """
    options: dict[str, Any] = {
        "--backend": backend,
        "--adapter": adapter,
        "--threads": _whole("threads", threads),
        "--steps": _whole("steps", steps),
        "--max-wall": max_wall.total_seconds() if isinstance(max_wall, datetime.timedelta) else max_wall,
        "--memory-limit": memory_limit,
    }
    flags = {"--picture": picture, "--force": force, "--force-disk": force_disk, "--resume": resume}
    where, text = case_text(case)
    folder = Path(out) if out is not None else Path("out") / (Path(where).stem if where is not None else "stdin")
    arguments = ["run", where or "-", f"--out={folder}", *_changes(spacing, until, set)]
    arguments += [f"{option}={value}" for option, value in options.items() if value is not None]
    # The case stands before --resume, which could take it for its folder.
    arguments += [flag for flag, given in flags.items() if given]
    if not progress:
        arguments.append("--quiet")
    code, _, remarks = _start(arguments, text, echo=progress)
    if code in (0, RESUMABLE):
        return read(folder)
    failure = error(remarks, code)
    if isinstance(failure, DivergedError) and (folder / "result.json").is_file():
        failure.run = read(folder)
    raise failure


def plan(
    case: Case,
    *,
    spacing: float | None = None,
    until: float | None = None,
    set: Mapping[str, Any] | None = None,  # noqa: A002, the option's name
) -> dict[str, Any]:
    """What a run would compute, and what it takes: `seixo plan --json`.

    Raises CaseError with the program's message.
    """
    where, text = case_text(case)
    code, answer, remarks = _start(["plan", where or "-", "--json", *_changes(spacing, until, set)], text, echo=False)
    if code != 0:
        raise error(remarks, code)
    found: dict[str, Any] = json.loads(answer)
    return found


def case_text(case: Case) -> tuple[str | None, str | None]:
    """The file of the case, or its text: one of them."""
    if isinstance(case, Mapping):
        return None, tomli_w.dumps(_table(case, ""))
    if not isinstance(case, (str, os.PathLike)):
        raise TypeError(f"case: a TOML file or a dict with the same keys, not {_named(case)}")
    return os.fspath(case), None


def _whole(name: str, value: Any) -> int | None:
    """A number of things."""
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    try:
        return None if value is None else operator.index(value)
    except TypeError:
        raise TypeError(f"{name}: a whole number, not {value!r}") from None


def _number(name: str, value: Any) -> float:
    """A number of Python's or numpy's."""
    if isinstance(value, numbers.Real) and not isinstance(value, bool):
        return float(value)
    raise TypeError(f"{name}: a number, not {_named(value)}")


def _named(value: Any) -> str:
    return "None" if value is None else f"a value of type {type(value).__name__}"


def _changes(spacing: float | None, until: float | None, sets: Mapping[str, Any] | None) -> list[str]:
    """Options that change the case."""
    changes = []
    if spacing is not None:
        changes.append(f"--spacing={_number('spacing', spacing)!r}")
    if until is not None:
        changes.append(f"--until={_number('until', until)!r}")
    changes += [f"--set={change}" for change in value_sets(sets)]
    return changes


def value_sets(sets: Mapping[str, Any] | None) -> list[str]:
    """Changes of single values, `key=value` with the value as TOML in one line; text stands as it is."""
    if sets is not None and not isinstance(sets, Mapping):
        raise TypeError(f'set: a dict such as {{"body.0.density": 800}}, not {_named(sets)}')
    given = (sets or {}).items()
    return [f"{key}={value if isinstance(value, str) else _inline(_plain(value, str(key)))}" for key, value in given]


def _inline(value: Any) -> str:
    """A value as TOML in one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {_inline(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(_inline(item) for item in value) + "]"
    return tomli_w.dumps({"x": value}).removeprefix("x = ").strip()


def _table(table: Mapping[str, Any], path: str) -> dict[str, Any]:
    before = f"{path}." if path else ""
    return {str(key): _plain(value, f"{before}{key}") for key, value in table.items() if value is not None}


def _plain(value: Any, path: str) -> Any:
    """The value of the key `path` as TOML has it: of arrays, lists; of paths, text; what is None is left out of tables."""
    if isinstance(value, Mapping):
        return _table(value, path)
    if hasattr(value, "tolist"):
        return _plain(value.tolist(), path)
    if isinstance(value, (list, tuple)):
        return [_plain(item, f"{path}.{k}") for k, item in enumerate(value)]
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, (numbers.Real, decimal.Decimal)):
        return float(value)
    raise TypeError(f"{path}: {_named(value)} is no value of a case: numbers, text, True or False, lists and dicts are")


def _start(arguments: list[str], text: str | None, *, echo: bool) -> tuple[int, str, str]:
    """Starts the program: its exit code, results and remarks."""
    process = subprocess.Popen(
        [str(program()), *arguments],
        stdin=subprocess.PIPE if text is not None else subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        errors="replace",
    )
    remarks: list[str] = []

    def listen() -> None:
        assert process.stderr is not None
        for line in process.stderr:
            remarks.append(line)
            if echo:
                sys.stderr.write(line)
                sys.stderr.flush()

    listener = threading.Thread(target=listen, daemon=True)
    listener.start()
    try:
        if text is not None and process.stdin is not None:
            try:
                process.stdin.write(text)
                process.stdin.close()
            except BrokenPipeError:
                pass  # it says why itself
        assert process.stdout is not None
        answer = process.stdout.read()
        process.wait()
    except KeyboardInterrupt:
        # The terminal has told the program, too; it saves its state and ends.
        process.wait()
        raise
    listener.join()
    return process.returncode, answer, "".join(remarks)
