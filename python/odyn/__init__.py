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
from ._elements import Element, Recorded, control, force, joint, save
from ._errors import Diagnostic, Error, Place, RunWarning
from ._functions import (
    acos,
    asin,
    atan,
    atan2,
    clip,
    cos,
    cross,
    dot,
    exp,
    hypot,
    length,
    log,
    maximum,
    minimum,
    sin,
    sqrt,
    table,
    tan,
    tanh,
)
from ._model import Model, load
from ._program import PROGRAM as _PROGRAM
from ._motion import Frame, Loads, Motion, Reaction
from ._run import Report, Run
from ._simulation import Saved, Simulation
from ._specs import (
    channel,
    check,
    choice_param,
    coordinate,
    flexible,
    function_param,
    memory,
    param,
    signal,
    state,
    surface_param,
    unknown,
    vector_param,
)
from ._study import Series, Study, grid, merge, study
from ._system import System
from ._tracing import Condition, Number, TraceError, Vec, where

__version__: str = _odyn.__version__

__all__ = [
    "Condition",
    "Diagnostic",
    "Element",
    "Error",
    "Fit",
    "Frame",
    "Linear",
    "Loads",
    "Model",
    "Motion",
    "Number",
    "Place",
    "Reaction",
    "Recorded",
    "Report",
    "Run",
    "RunWarning",
    "Saved",
    "Series",
    "Simulation",
    "Study",
    "System",
    "TraceError",
    "Vec",
    "acos",
    "asin",
    "atan",
    "atan2",
    "channel",
    "check",
    "choice_param",
    "clip",
    "control",
    "coordinate",
    "cos",
    "cross",
    "dot",
    "exp",
    "flexible",
    "force",
    "function_param",
    "grid",
    "hypot",
    "joint",
    "length",
    "load",
    "log",
    "maximum",
    "memory",
    "merge",
    "minimum",
    "param",
    "save",
    "signal",
    "sin",
    "sqrt",
    "state",
    "study",
    "surface_param",
    "table",
    "tan",
    "tanh",
    "unknown",
    "vector_param",
    "where",
]

if _PROGRAM.is_file():
    _odyn.belongs_to(_PROGRAM)
    _atexit.register(_odyn.farewell)
