"""Where the program is."""

from __future__ import annotations

import os
import shutil
import sysconfig
from pathlib import Path

#: Names another program than the installed one.
VARIABLE = "SEIXO_PROGRAM"


def program() -> Path:
    """The program `seixo`: the one that the variable SEIXO_PROGRAM names, the one installed with this package, or the one on
    the search path.

    Raises FileNotFoundError if there is none.
    """
    named = os.environ.get(VARIABLE)
    if named:
        if not Path(named).is_file():
            raise FileNotFoundError(f"{VARIABLE} names `{named}`, which is no file")
        return Path(named)
    name = "seixo.exe" if os.name == "nt" else "seixo"
    schemes = [sysconfig.get_default_scheme(), sysconfig.get_preferred_scheme("user")]
    for scheme in schemes:
        path = Path(sysconfig.get_path("scripts", scheme)) / name
        if path.is_file():
            return path
    found = shutil.which("seixo")
    if found is None:
        raise FileNotFoundError(
            "the program `seixo` is not installed: `pip install .` in its repository, "
            f"or name it with the variable {VARIABLE}"
        )
    return Path(found)
