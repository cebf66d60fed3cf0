"""Reads what a run has written."""

from __future__ import annotations

import csv
import functools
import html
import json
import os
import re
import tomllib
import warnings
import xml.etree.ElementTree
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union, cast, overload

import numpy as np
import numpy.typing as npt

from ._errors import FileError

if TYPE_CHECKING:
    import pandas

#: A table: a pandas.DataFrame, or without pandas a numpy.recarray. Both give a column by its name, as `t["time"]` and `t.time`.
Table = Union["pandas.DataFrame", "np.recarray[Any, Any]"]

Array = npt.NDArray[Any]


def read(folder: str | os.PathLike[str]) -> Run:
    """The results in the folder of a run, also of one that is under way, was stopped or has failed.

    Raises FileNotFoundError if there are none.
    """
    return Run(Path(folder))


class Run:
    """The results of a run. Files are read when they are asked for, and then kept; `read` again to see what was added."""

    def __init__(self, path: Path) -> None:
        if not (path / "case.toml").is_file():
            raise FileNotFoundError(f"{path}: no results of seixo (no case.toml)")
        #: The folder.
        self.path = path

    def __repr__(self) -> str:
        return f"<seixo.Run {str(self.path)!r}: {self.result.get('status', 'no result yet')}, {len(self.frames)} frames>"

    @functools.cached_property
    def result(self) -> dict[str, Any]:
        """result.json: how the run ended, its verdict, sums and extremes; empty while it is under way."""
        try:
            text = (self.path / "result.json").read_text(encoding="utf-8")
        except FileNotFoundError:
            return {}
        try:
            found: dict[str, Any] = json.loads(text)
        except ValueError as why:
            raise FileError(f"{self.path / 'result.json'}: damaged ({why}); without it the run counts as under way", 5) from None
        return found

    @property
    def status(self) -> str | None:
        """`done`, `interrupted`, `diverged` or `failed`; None while it is under way."""
        return self.result.get("status")

    @property
    def verdict(self) -> str | None:
        """`fine`, `degraded` or `failed`; the reasons stand in `result["verdict"]["reasons"]`."""
        grade: str | None = self.result.get("verdict", {}).get("grade")
        return grade

    @property
    def water(self) -> dict[str, float]:
        """Volumes of water [m3] of a case with inflow or outflow, at the end: `water_volume`, `inflow_NAME` and `outflow_NAME` as the columns
        of `monitors` are called, and `start` and `lost`. Their sums agree to the particle. Empty without openings, and while the
        run is under way."""
        told: dict[str, Any] = self.result.get("water") or {}
        if not told:
            return {}
        each = told["volume_start_m3"] / max(told["particles_start"], 1) or told["volume_end_m3"] / max(told["particles_end"], 1)
        volumes = {"water_volume": told["volume_end_m3"], "start": told["volume_start_m3"], "lost": told["particles_lost"] * each}
        return volumes | {f"{way}_{one['name']}": one["volume_m3"] for way in ("inflow", "outflow") for one in told[way]}

    @functools.cached_property
    def case(self) -> dict[str, Any]:
        """The case as it was run."""
        return tomllib.loads((self.path / "case.toml").read_text(encoding="utf-8"))

    @functools.cached_property
    def monitors(self) -> Table:
        """monitors.csv: time step, energies, iterations, seconds per stage and more over time."""
        return self.table("monitors")

    @functools.cached_property
    def bodies(self) -> Table:
        """bodies.csv: a row for each time and solid. `body` picks one."""
        return self.table("bodies")

    @functools.cached_property
    def gauges(self) -> Table:
        """gauges.csv: what the case asks to measure."""
        return self.table("gauges")

    def body(self, name: str) -> Table:
        """The rows of bodies.csv of the body or moving wall `name`."""
        table = self.bodies
        names = [str(n) for n in table["body"]]
        if name not in names:
            known = ", ".join(dict.fromkeys(names))
            raise KeyError(f"no solid is called {name!r}; there are: {known}")
        rows: Any = table[table["body"] == name]
        return cast(Table, rows.reset_index(drop=True) if hasattr(rows, "reset_index") else rows)

    def table(self, name: str) -> Table:
        """The table `name`.csv. Columns are called as in the file without the unit, as Python names: `gate_x [m]` is `gate_x`.
        The units are in `attrs["units"]` of a DataFrame, and in `units(name)`.

        Raises FileNotFoundError if the run wrote none: there is no bodies.csv without solids, no gauges.csv without gauges.
        """
        headers, rows = self._rows(name)
        columns = [_column(header, [row[k] for row in rows]) for k, header in enumerate(headers)]
        names = _names(headers)
        try:
            import pandas
        except ImportError:
            return cast(Table, np.rec.fromarrays(columns, names=",".join(names)))  # type: ignore[call-overload]
        frame = pandas.DataFrame(dict(zip(names, columns)))
        frame.attrs["units"] = _units(names, headers)
        return frame

    def units(self, name: str) -> dict[str, str]:
        """The unit of each column of the table `name`.csv."""
        headers, _ = self._rows(name)
        return _units(_names(headers), headers)

    def _rows(self, name: str) -> tuple[list[str], list[list[str]]]:
        path = self.path / f"{name}.csv"
        if not path.is_file():
            there = ", ".join(sorted(p.stem for p in self.path.glob("*.csv"))) or "none"
            raise FileNotFoundError(f"{path}: this run wrote no such table; tables: {there}")
        rows: list[tuple[int, list[str]]] = []
        try:
            with path.open(newline="", encoding="utf-8") as file:
                reader = csv.reader(file)
                rows.extend((reader.line_num, row) for row in reader)
        except UnicodeDecodeError:
            raise _damaged(path, rows[-1][0] + 1 if rows else 1, "it is no text in UTF-8") from None
        except csv.Error as why:
            raise _damaged(path, rows[-1][0] + 1 if rows else 1, str(why)) from None
        if not rows:
            raise _damaged(path, 1, "it is empty")
        (_, headers), *rows = rows
        own = name in ("monitors", "bodies", "gauges")
        for column in ("time [s]", "body") if name == "bodies" else ("time [s]",) if own else ():
            if column not in headers:
                raise _damaged(path, 1, f"it has no column {column!r}")
        # A run in progress may be in the middle of its last row.
        for line, row in rows[:-1]:
            if len(row) != len(headers):
                raise _damaged(path, line, f"it has {len(row)} values, the line of names {len(headers)}")
        return headers, [row for _, row in rows if len(row) == len(headers)]

    @functools.cached_property
    def frames(self) -> Frames:
        """The moments that were written, in the order of time."""
        return Frames(_frames(self.path))

    @functools.cached_property
    def series(self) -> dict[str, Frames]:
        """The frames of each `[[output.series]]` of the case, by its name."""
        names = [named["name"] for named in self.case.get("output", {}).get("series", [])]
        return {name: Frames(_frames(self.path / "series" / name)) for name in names}

    @functools.cached_property
    def walls(self) -> Particles:
        """The particles of fixed walls."""
        return Particles(self.path / "vtu" / "walls.vtu")


class Particles:
    """The particles of a file, read when a field is asked for. Rows belong together across fields."""

    def __init__(self, path: Path) -> None:
        #: The file.
        self.path = path

    def __len__(self) -> int:
        return len(self.position)

    def __repr__(self) -> str:
        return f"<seixo.Particles {str(self.path)!r}>"

    @functools.cached_property
    def _fields(self) -> dict[str, Array]:
        if not self.path.is_file():
            raise FileNotFoundError(f"{self.path}: not written; `output.kinds` of the case says which particles are")
        return _particles(self.path)

    def field(self, name: str) -> Array:
        """The field `name` as it is called in the file, e.g. `Velocity`."""
        if name not in self._fields:
            there = ", ".join(self._fields)
            raise KeyError(f"{self.path.name} holds no field {name!r} (`output.fields` of the case says which are written); there are: {there}")
        return self._fields[name]

    @property
    def position(self) -> Array:
        """Positions [m], a row each."""
        return self._fields["Points"]

    @property
    def velocity(self) -> Array:
        """Velocities [m/s], a row each."""
        return self.field("Velocity")

    @property
    def pressure(self) -> Array:
        """Pressures [Pa]."""
        return self.field("Pressure")

    @property
    def number_density(self) -> Array:
        """Particle number densities [-]."""
        return self.field("ParticleNumberDensity")

    @property
    def kind(self) -> Array:
        """0 fluid, 1 wall, 2 dummy, 3 body wall, 4 body dummy."""
        return self.field("Kind")

    @property
    def body(self) -> Array:
        """0 for none, then the number of the solid in the order of bodies.csv."""
        return self.field("Body")

    @property
    def id(self) -> Array:
        """Stays with a particle."""
        return self.field("Id")


class Frame:
    """A moment of a run."""

    def __init__(self, time: float, fluid: Path | None, solids: Path | None) -> None:
        #: Time [s].
        self.time = time
        self._fluid, self._solids = fluid, solids

    def __repr__(self) -> str:
        return f"<seixo.Frame at {self.time:g} s>"

    @functools.cached_property
    def fluid(self) -> Particles:
        """The water."""
        return self._part(self._fluid, "water")

    @functools.cached_property
    def solids(self) -> Particles:
        """Bodies and moving walls."""
        return self._part(self._solids, "bodies")

    def _part(self, path: Path | None, what: str) -> Particles:
        if path is None:
            raise LookupError(f"no {what} at {self.time:g} s; `output.kinds` of the case says what is written")
        return Particles(path)


NO_FRAMES = "there are no frames: `output.every` of the case, or their list (.pvd) or files are gone"


class Frames(Sequence[Frame]):
    """Frames in the order of time."""

    def __init__(self, frames: Sequence[Frame]) -> None:
        self._frames = list(frames)

    def __len__(self) -> int:
        return len(self._frames)

    def __iter__(self) -> Iterator[Frame]:
        return iter(self._frames)

    @overload
    def __getitem__(self, index: int) -> Frame: ...
    @overload
    def __getitem__(self, index: slice) -> Frames: ...
    def __getitem__(self, index: int | slice) -> Frame | Frames:
        if isinstance(index, slice):
            return Frames(self._frames[index])
        if not -len(self) <= index < len(self):
            raise IndexError(f"frame {index}: there are {len(self)}" if len(self) else NO_FRAMES)
        return self._frames[index]

    def __repr__(self) -> str:
        return f"<seixo.Frames: {len(self)}>"

    @property
    def times(self) -> npt.NDArray[np.float64]:
        """Their times [s]."""
        return np.array([frame.time for frame in self._frames])

    def at(self, time: float) -> Frame:
        """The frame nearest to `time` [s]."""
        if not self._frames:
            raise LookupError(NO_FRAMES)
        return min(self._frames, key=lambda frame: abs(frame.time - time))


def _frames(folder: Path) -> list[Frame]:
    """The frames that the list of the run, its PVD file, names."""
    lists = list(folder.glob("*.pvd"))
    if not lists:
        return []
    found: dict[float, dict[str, Path]] = {}
    text = lists[0].read_text(encoding="utf-8", errors="replace")
    cut = not text.rstrip().endswith("</VTKFile>")
    if cut:
        warnings.warn(f"{lists[0]} is cut off: frames that it does not name are left out", stacklevel=4)
    # A line each: those of a list that is cut off are as good as ever.
    for line in re.findall(r"<DataSet [^>]*/>", text):
        item = {key: html.unescape(value) for key, value in re.findall(r' (\w+)="([^"]*)"', line)}
        file = Path(item.get("file", ""))
        # A list that somebody changed leads nowhere else.
        if not file.is_absolute() and ".." not in file.parts:
            found.setdefault(float(item.get("timestep", "nan")), {})[item.get("name", "")] = folder / file
    moments = list(found)
    if cut and moments and found[moments[-1]].keys() != found[moments[0]].keys():
        del found[moments[-1]]
    frames = []
    for time, parts in found.items():
        # What stands still is no part of a moment.
        moving = [path for name, path in parts.items() if name in ("fluid", "solids")]
        flaws = [flaw for flaw in map(_flaw, moving) if flaw]
        if flaws:
            warnings.warn(f"the frame at {time:g} s is left out: {', '.join(flaws)}", stacklevel=4)
        else:
            frames.append(Frame(time, parts.get("fluid"), parts.get("solids")))
    return frames


def _flaw(path: Path) -> str | None:
    """What shows at the ends of a file of a frame, or of a piece of it, that cannot be read."""
    try:
        with path.open("rb") as file:
            length = file.seek(0, os.SEEK_END)
            file.seek(max(0, length - 64))
            end = file.read().rstrip()
    except FileNotFoundError:
        return f"{path} is gone"
    except OSError as why:
        return f"{path}: {why.strerror}"
    if not end.endswith(b"</VTKFile>"):
        return f"{path} is cut off" if length else f"{path} is empty"
    pieces = _pieces(path) if path.suffix == ".pvtu" else []
    return next((flaw for flaw in map(_flaw, pieces) if flaw), None)


def _pieces(path: Path) -> list[Path]:
    """The files of the water that many ranks wrote, of which a PVTU file names one each."""
    pieces = [Path(item.get("Source", "")) for item in xml.etree.ElementTree.parse(path).iter("Piece")]
    # A list that somebody changed leads nowhere else.
    if any(len(piece.parts) != 1 or piece.parts[0] == ".." or piece.suffix != ".vtu" for piece in pieces):
        raise ValueError(f"{path}: it names a file that is no piece")
    return [path.parent / piece for piece in pieces]


def _particles(path: Path) -> dict[str, Array]:
    """Points and fields of a VTU file, or of all pieces that a PVTU file names."""
    if path.suffix != ".pvtu":
        return _vtu(path)
    parts = [_vtu(piece) for piece in _pieces(path)]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _vtu(path: Path) -> dict[str, Array]:
    """Points and fields of a VTU file, by whichever library is there."""
    try:
        import pyvista
    except ImportError:
        pass
    else:
        mesh = pyvista.read(path)
        return {"Points": np.asarray(mesh.points), **{k: np.asarray(v) for k, v in mesh.point_data.items()}}
    try:
        import meshio
    except ImportError:
        raise ImportError("frames are read by pyvista or meshio: `pip install meshio` or `pip install pyvista`") from None
    with path.open("rb") as file:
        # The head of a file stands before its arrays.
        head = file.read(1 << 14).decode("latin-1")
    if 'NumberOfPoints="0"' in head:
        # meshio reads no file without points: a region without water, or a rank's piece of it.
        arrays = re.findall(r'<DataArray type="(\w+)" Name="(\w+)" NumberOfComponents="(\d)" format="appended"', head)
        empty = {name: np.empty((0, 3) if size == "3" else 0, np.dtype(of.lower())) for of, name, size in arrays}
        return {name: values for name, values in empty.items() if name not in ("connectivity", "offsets", "types")}
    if '<AppendedData encoding="raw">' in head:
        raise ImportError(f'{path}: `output.encoding = "raw"` is read by pyvista alone: `pip install pyvista`')
    try:
        # `meshio.read` ends the whole program where it cannot read a file.
        mesh = meshio.vtu.read(path)
    except Exception as why:
        raise FileError(f"{path}: damaged ({str(why) or type(why).__name__})", 5) from None
    # It keeps a column of fields with one component.
    fields = {name: values.reshape(-1) if values.shape[1:] == (1,) else values for name, values in mesh.point_data.items()}
    return {"Points": mesh.points, **fields}


def _damaged(path: Path, line: int, why: str) -> FileError:
    """The error of a table that no run wrote as it is."""
    return FileError(f"{path}: line {line}: {why}; this is no table of seixo's, or somebody changed it: run the case again", 5)


def _column(header: str, cells: list[str]) -> Array:
    """Numbers, if all are; what is empty is none. Names stay names: a body may be called `1`."""
    if header == "body":
        return np.array(cells, dtype=object)
    try:
        return np.array([float(cell) if cell else np.nan for cell in cells])
    except ValueError:
        return np.array(cells, dtype=object)


def _names(headers: list[str]) -> list[str]:
    """Python names from headers such as `fluid x [m]`; no name twice."""
    names: list[str] = []
    for header in headers:
        bare = re.sub(r"\s*\[[^\]]*\]\s*$", "", header)
        name = re.sub(r"\W+", "_", bare).strip("_") or "column"
        name = f"_{name}" if name[0].isdigit() else name
        again = sum(1 for n in names if n == name or re.fullmatch(rf"{re.escape(name)}_\d+", n))
        names.append(f"{name}_{again + 1}" if name in names else name)
    return names


def _units(names: list[str], headers: list[str]) -> dict[str, str]:
    found = (re.search(r"\[([^\]]*)\]\s*$", header) for header in headers)
    return {name: unit.group(1) for name, unit in zip(names, found) if unit}
