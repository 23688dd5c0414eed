"""O-DYN: multibody dynamics with joints and forces from plugins.

    import odyn

    run = odyn.load("compressor.toml").set({"rod.length": "50 mm"}).run()
    run["x_p"]          # a NumPy array, in run.units["x_p"]

Scenes are files, described in the book; everything about them that has a place or a unit says so. Numbers without a unit are in
the units of the scene.
"""

import atexit as _atexit

from . import _odyn
from ._analyses import Fit, Linear
from ._errors import Diagnostic, Error, Place, RunWarning
from ._model import Model, load
from ._program import PROGRAM as _PROGRAM
from ._run import Report, Run
from ._simulation import Saved, Simulation
from ._study import Study, grid, study
from ._system import System

__version__: str = _odyn.__version__

__all__ = [
    "Diagnostic",
    "Error",
    "Fit",
    "Linear",
    "Model",
    "Place",
    "Report",
    "Run",
    "RunWarning",
    "Saved",
    "Simulation",
    "Study",
    "System",
    "grid",
    "load",
    "study",
]

if _PROGRAM.is_file():
    _odyn.belongs_to(_PROGRAM)
    _atexit.register(_odyn.farewell)
