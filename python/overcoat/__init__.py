"""Layered, energy-conserving BSDFs from Open Shading Language style scripts.

>>> import overcoat
>>> cloth = overcoat.compile("Ci = sheen(0.8 * diffuse(N), N, 1, 0.4);")
>>> cloth.check().verdict
'conserves'

Directions are unit vectors in world space, away from the surface; colors are linear RGB; arrays are float32.
"""

from . import plot
from ._overcoat import Bsdf, Engine, Material, Report, Samples, ScriptError, __version__

#: Kinds of scattering, as bits of `Bsdf.flags` and `Samples.flags`.
REFLECT, TRANSMIT, DIFFUSE, GLOSSY, DELTA, NULL, EMISSION = (1 << bit for bit in range(7))


def compile(source, name="material", **params):
    """A material from a script, with the default engine; keywords set its parameters."""
    return Engine().compile(source, name, **params)


__all__ = [
    "Bsdf", "Engine", "Material", "Report", "Samples", "ScriptError", "compile", "plot", "__version__",
    "REFLECT", "TRANSMIT", "DIFFUSE", "GLOSSY", "DELTA", "NULL", "EMISSION",
]
