from os import PathLike
from typing import Literal, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

Triple = Union[Sequence[float], NDArray[np.float32]]
Param = Union[int, float, str, Triple]

__version__: str

class ScriptError(ValueError):
    """What is wrong with a script."""

    places: list[Tuple[str, int, int, str, str]]
    """(file, line, column, code, message), lines and columns counted from 1."""

class Engine:
    """Compiles scripts."""

    def __new__(
        cls,
        *,
        tier: Literal["fast", "standard"] = "standard",
        layering: Literal["min", "view", "balanced"] = "min",
        include_dirs: Sequence[Union[str, PathLike[str]]] = (),
    ) -> "Engine": ...
    def compile(self, source: str, name: str = "material", **params: Param) -> "Material":
        """Compiles a script and sets parameters. Raises ScriptError."""

class Material:
    """A script with its parameters set. May be used from any thread."""

    @property
    def name(self) -> str:
        """The name of the shader."""
    @property
    def params(self) -> dict[str, Union[int, float, str, list[float], None]]:
        """The declared parameters and their values; None where a default depends on the point."""
    def set(self, **params: Param) -> None:
        """Sets parameters by name; all or, if one is wrong, none. Raises ScriptError."""
    def shade(
        self,
        wo: Triple = (0.0, 0.0, 1.0),
        *,
        n: Triple = (0.0, 0.0, 1.0),
        ng: Optional[Triple] = None,
        p: Triple = (0.0, 0.0, 0.0),
        u: float = 0.0,
        v: float = 0.0,
        dpdu: Triple = (1.0, 0.0, 0.0),
        dpdv: Triple = (0.0, 1.0, 0.0),
        time: float = 0.0,
        backfacing: bool = False,
    ) -> "Bsdf":
        """The BSDF at a point seen from `wo` (world space, unit, away from the surface)."""
    def albedo(self, w: ArrayLike, side: Literal["view", "light"] = "view") -> NDArray[np.float32]:
        """Directional albedos (n, 3) for directions (n, 3) by adaptive quadrature, delta lobes added."""
    def check(self) -> "Report":
        """Proves that the material keeps energy, finds where it gains, or says what stood in the way."""
    def tree(self, u: float = 0.0, v: float = 0.0) -> dict:
        """The closure tree at a point as nested dictionaries."""
    def render(
        self,
        size: int = 256,
        spp: int = 16,
        *,
        scene: Literal["sphere", "ball", "drape", "furnace"] = "sphere",
        seed: int = 0,
        threads: int = 0,
    ) -> NDArray[np.float32]:
        """A picture (size, size, 3) of linear radiance."""

class Report:
    """What became of a proof."""

    verdict: Literal["conserves", "gains", "undecided"]
    bound: Optional[float]
    witness: Optional[Tuple[Literal["view", "light"], list[float], list[float]]]
    messages: list[str]

class Bsdf:
    """What a surface does with light at one point, seen from one direction."""

    def eval(self, wi: ArrayLike) -> Tuple[NDArray[np.float32], NDArray[np.float32]]:
        """f·|cos| (n, 3) and pdf (n) for directions (n, 3): world space, unit, away from the surface."""
    def sample(self, u: ArrayLike) -> "Samples":
        """Draws a direction for each row of `u` (n, 3): uniform numbers in [0, 1)."""
    @property
    def albedo(self) -> list[float]:
        """A quick estimate of the albedo toward the viewer."""
    def albedo_bound(self, w: Triple) -> list[float]:
        """Never below the albedo with the viewer, or the light, along `w`."""
    @property
    def emission(self) -> list[float]:
        """Radiance given off toward the viewer."""
    @property
    def transparency(self) -> list[float]:
        """What goes straight through."""
    @property
    def flags(self) -> int:
        """Kinds of scattering that may occur: a sum of overcoat.REFLECT and its like."""
    @property
    def wo(self) -> list[float]:
        """The direction toward the viewer."""

class Samples:
    """Directions drawn from a BSDF."""

    wi: NDArray[np.float32]
    f_cos: NDArray[np.float32]
    pdf: NDArray[np.float32]
    weight: NDArray[np.float32]
    flags: NDArray[np.uint32]
    eta: NDArray[np.float32]
    roughness: NDArray[np.float32]
