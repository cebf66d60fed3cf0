"""Water that carries solids, from Python: run cases, read results.

    import seixo

    run = seixo.run("floating-body.toml", spacing=0.02)
    run.verdict                      # 'fine'
    run.body("box").z                # a column of bodies.csv
    run.frames[-1].fluid.velocity    # an array, read when it is asked for

`seixo.run` starts the program `seixo` and returns when it has ended; `seixo.read` opens what any run has written.
`seixo.open` advances a case step by step in this process, writes nothing and lets Python look at all of it.
"""

from ._errors import CaseError, DeviceError, DivergedError, FileError, SeixoError
from ._program import program
from ._results import Frame, Frames, Particles, Run, Table, read
from ._run import plan, run
from ._simulation import Simulation, Solid, Step, Water, open

__all__ = [
    "CaseError",
    "DeviceError",
    "DivergedError",
    "FileError",
    "Frame",
    "Frames",
    "Particles",
    "Run",
    "SeixoError",
    "Simulation",
    "Solid",
    "Step",
    "Table",
    "Water",
    "open",
    "plan",
    "program",
    "read",
    "run",
]
