"""A simulation that is advanced step by step."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ._run import Case, case_text, value_sets

if TYPE_CHECKING:
    from . import _native

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Step:
    """What a step did."""

    #: Time at its end [s].
    time: float
    #: Its length [s].
    dt: float
    #: Iterations of the pressure solver.
    iterations: int
    #: Its residual over the right side [-].
    residual: float
    #: Whether that met the tolerance of the case.
    solved: bool
    #: Sub-steps of contact.
    contact_substeps: int


@dataclass(frozen=True)
class Water:
    """The particles of water at a moment: copies that later steps do not change, and that cannot be written to. Rows belong together;
    their order changes from step to step, `id` stays with a particle."""

    #: Positions [m], (n, 3).
    position: Floats
    #: Velocities [m/s], (n, 3).
    velocity: Floats
    #: Pressures [Pa], (n,); 0 before the first step.
    pressure: Floats
    #: Particle number densities [-], (n,); 0 before the first step.
    number_density: Floats
    #: Numbers of the particles, (n,).
    id: npt.NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.id)


@dataclass(frozen=True)
class Solid:
    """A body or a moving wall at a moment."""

    #: Its name in the case.
    name: str
    #: True of a body, False of a moving wall.
    is_body: bool
    #: Centre of mass [m], (3,).
    position: Floats
    #: Unit quaternion w, x, y, z that turns the shape, as its keys (file, section, axis) describe it, into the world; at the start what
    #: `orientation` says, (4,).
    orientation: Floats
    #: Velocity of the centre of mass [m/s], (3,).
    velocity: Floats
    #: Angular velocity [rad/s], (3,).
    angular_velocity: Floats
    #: Force of the water in the last step [N], (3,).
    fluid_force: Floats
    #: Torque of the water about the centre of mass in the last step [N m], (3,).
    fluid_torque: Floats


def open(  # noqa: A001, the name of what it does
    case: Case,
    *,
    spacing: float | None = None,
    set: Mapping[str, Any] | None = None,  # noqa: A002, the option's name
    backend: str = "auto",
    adapter: str | int | None = None,
    threads: int | None = None,
) -> Simulation:
    """Opens a case to be advanced from Python; nothing is written.

    case: a TOML file, or a dict with the same keys. Paths in a dict count from the working directory.
    set: values of the case to change, e.g. `{"fluid.preset": "paper", "body.0.density": 800}`.
    backend: "auto" (a hardware GPU if there is one, else the CPU), "gpu" or "cpu". adapter: which GPU, by number or a part of its name.
    threads: of the CPU; all cores if absent. Results do not depend on them.

    Raises CaseError, DeviceError or FileError with the program's message, ImportError where the package was not installed with its
    compiled part (`pip install .` in its repository).
    """
    return Simulation(case, spacing=spacing, set=set, backend=backend, adapter=adapter, threads=threads)


class Simulation:
    """A case in motion; `seixo.open` makes one."""

    def __init__(
        self,
        case: Case,
        *,
        spacing: float | None = None,
        set: Mapping[str, Any] | None = None,  # noqa: A002, the option's name
        backend: str = "auto",
        adapter: str | int | None = None,
        threads: int | None = None,
    ) -> None:
        try:
            from . import _native
        except ImportError:
            raise ImportError(
                "stepping needs the compiled part of the package: `pip install .` in the repository of seixo"
            ) from None
        path, text = case_text(case)
        device = None if adapter is None else str(adapter)
        self._native: _native.Simulation = _native.Simulation(
            path, text, spacing, value_sets(set), backend, device, threads
        )
        for warning in self._native.warnings:
            print(warning, file=sys.stderr)
        self._water: tuple[int, Water] | None = None

    def __repr__(self) -> str:
        return f"<seixo.Simulation at {self.time:g} s after {self.steps} steps on {self.processor}>"

    @property
    def time(self) -> float:
        """Time [s]."""
        return self._native.time

    @property
    def steps(self) -> int:
        """Steps done."""
        return self._native.steps

    @property
    def end(self) -> float:
        """The end that the case names, `run.end` [s]; a simulation goes on beyond it if it is asked to."""
        return self._native.clock[0]

    @property
    def processor(self) -> str:
        """What computes, and how precisely."""
        return ", ".join(dict.fromkeys(", ".join(self._native.processor).split(", ")))

    def step(self) -> Step:
        """Advances by one time step. Other Python threads run meanwhile.

        Raises DivergedError or DeviceError; the simulation cannot go on then.
        """
        dt, iterations, residual, solved, substeps = self._native.step()
        return Step(self.time, dt, iterations, residual, solved, substeps)

    def run_until(self, time: float, observer: Callable[[Simulation, Step], object] | None = None) -> None:
        """Advances to `time` [s] or just beyond it. `observer` is called after every step with the simulation and the step;
        if it returns False, the run ends there.

        Raises as `step`, and what `observer` raises.
        """
        # A rounding error short of the end is the end.
        while self.time < time - 1e-6 * self._native.clock[1]:
            step = self.step()
            if observer is not None and observer(self, step) is False:
                break

    def __iter__(self) -> Iterator[Step]:
        """Steps to the end of the case."""
        while self.time < self.end - 1e-6 * self._native.clock[1]:
            yield self.step()

    @property
    def water(self) -> Water:
        """The water now, copied once a step; empty in a dry scene."""
        if self._water is None or self._water[0] != self.steps:
            position, velocity, pressure, density, number = (np.frombuffer(b) for b in self._native.water())
            water = Water(position.reshape(-1, 3), velocity.reshape(-1, 3), pressure, density, number.astype(np.int64))
            self._water = (self.steps, water)
        return self._water[1]

    @property
    def positions(self) -> Floats:
        """Positions of the water [m], (n, 3): `water.position`."""
        return self.water.position

    @property
    def velocity(self) -> Floats:
        """Velocities of the water [m/s], (n, 3): `water.velocity`."""
        return self.water.velocity

    @property
    def pressure(self) -> Floats:
        """Pressures of the water [Pa], (n,): `water.pressure`."""
        return self.water.pressure

    @property
    def bodies(self) -> dict[str, Solid]:
        """Bodies and moving walls now, by their names, in the order of bodies.csv."""
        found = {}
        for name, is_body, *vectors in self._native.solids():
            found[name] = Solid(name, is_body, *(np.array(v, dtype=np.float64) for v in vectors))
        return found

    @property
    def gauges(self) -> dict[str, float]:
        """What the gauges of the case read now, by the columns of gauges.csv without their units; not a number where there is nothing
        to read."""
        return {re.sub(r"\s*\[[^\]]*\]$", "", column): value for column, value in self._native.gauges()}

    @property
    def monitor(self) -> dict[str, float]:
        """Energies [J], largest speed [m/s], error of the number density [-] and lost particles now; with inflow or outflow the volume of the
        water and what each has let through [m3]. Called as in monitors.csv."""
        return dict(self._native.monitor())
