import os
import pathlib
from collections.abc import Iterator
from typing import Any, Literal, NamedTuple, TypeAlias, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "Mesh",
    "Program",
    "RfmError",
    "Simulation",
    "Slice",
    "Solid",
    "__version__",
    "load",
    "Audit",
    "Collisions",
    "Contact",
    "Diagnostic",
    "Entry",
    "Param",
    "Stats",
]

__version__: str

# numbers have the type of the points, float32 or float64
_Array: TypeAlias = NDArray[Any]
_Doubles: TypeAlias = NDArray[np.float64]
_Path: TypeAlias = str | os.PathLike[str]

class Diagnostic(NamedTuple):
    severity: str
    code: str
    message: str
    file: str
    line: int | None
    column: int | None
    end_line: int | None
    end_column: int | None
    help: str | None

class Param(NamedTuple):
    value: float
    low: float | None
    high: float | None
    doc: str | None
    unit: str | None

class Contact(NamedTuple):
    distance: Any
    normal: _Array
    curvature: Any

class Entry(NamedTuple):
    part: Any
    point: _Doubles
    normal: _Doubles
    certain: Any

class Collisions(NamedTuple):
    hits: int
    stuck: int
    undefined: int

class Audit(NamedTuple):
    energy_excess: float | None
    unjudged: str | None
    wall_work: float | None
    volume_change: float
    compression_mean: float
    compression_p99: float
    compression_max: float
    crowded: float
    max_speed: float
    findings: tuple[str, ...]

class Stats(NamedTuple):
    particles: int
    kinetic_energy: float
    potential_energy: float
    momentum: tuple[float, float, float]
    max_speed: float
    max_density_error: float
    inside: int
    lost: int
    non_finite: int

class RfmError(ValueError):
    diagnostics: tuple[Diagnostic, ...]

def load(path_or_text: _Path, path: _Path | None = None, /, **params: float | str) -> Program: ...
@final
class Program:
    @property
    def solids(self) -> list[str]: ...
    @property
    def scenes(self) -> list[str]: ...
    @property
    def params(self) -> dict[str, Param]: ...
    @property
    def warnings(self) -> tuple[Diagnostic, ...]: ...
    @property
    def path(self) -> str | None: ...
    @property
    def text(self) -> str: ...
    def solid(self, name: str | None = None) -> Solid: ...
    def scene(self, name: str | None = None, *, threads: int | None = None) -> Simulation: ...
    def with_params(self, **params: float | str) -> Program: ...
    def __getitem__(self, name: str, /) -> Solid: ...
    def __contains__(self, name: object, /) -> bool: ...
    def __iter__(self) -> Iterator[str]: ...
    def __len__(self) -> int: ...
    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]: ...

@final
class Solid:
    @property
    def name(self) -> str: ...
    @property
    def program(self) -> Program: ...
    @property
    def time(self) -> float: ...
    @property
    def moves(self) -> bool: ...
    @property
    def is_compiled(self) -> bool: ...
    @property
    def bounds(self) -> _Doubles | None: ...
    @overload
    def __call__(self, points: float, y: float, z: float, /) -> float: ...
    @overload
    def __call__(self, points: ArrayLike, y: ArrayLike | None = None, z: ArrayLike | None = None, /) -> Any: ...
    @overload
    def omega(self, points: float, y: float, z: float, /, *, threads: int | None = None) -> float: ...
    @overload
    def omega(
        self,
        points: ArrayLike,
        y: ArrayLike | None = None,
        z: ArrayLike | None = None,
        /,
        *,
        out: _Array | None = None,
        threads: int | None = None,
    ) -> Any: ...
    def gradient(
        self,
        points: ArrayLike,
        y: ArrayLike | None = None,
        z: ArrayLike | None = None,
        /,
        *,
        out: _Array | None = None,
        threads: int | None = None,
    ) -> _Array: ...
    def omega_gradient(
        self,
        points: ArrayLike,
        y: ArrayLike | None = None,
        z: ArrayLike | None = None,
        /,
        *,
        out: tuple[_Array | None, _Array | None] | None = None,
        threads: int | None = None,
    ) -> tuple[Any, _Array]: ...
    @overload
    def sign(self, points: float, y: float, z: float, /, *, threads: int | None = None) -> float: ...
    @overload
    def sign(
        self,
        points: ArrayLike,
        y: ArrayLike | None = None,
        z: ArrayLike | None = None,
        /,
        *,
        out: _Array | None = None,
        threads: int | None = None,
    ) -> Any: ...
    def contact(
        self,
        points: ArrayLike,
        y: ArrayLike | None = None,
        z: ArrayLike | None = None,
        /,
        *,
        out: tuple[_Array | None, _Array | None, _Array | None] | None = None,
        threads: int | None = None,
    ) -> Contact: ...
    def wall_velocity(
        self,
        points: ArrayLike,
        y: ArrayLike | None = None,
        z: ArrayLike | None = None,
        /,
        *,
        out: _Array | None = None,
        threads: int | None = None,
    ) -> _Array: ...
    @overload
    def clearance(self, points: float, y: float, z: float, /, *, threads: int | None = None) -> float: ...
    @overload
    def clearance(
        self,
        points: ArrayLike,
        y: ArrayLike | None = None,
        z: ArrayLike | None = None,
        /,
        *,
        out: _Array | None = None,
        threads: int | None = None,
    ) -> Any: ...
    def first_entry(self, start: ArrayLike, end: ArrayLike, *, threads: int | None = None) -> Entry: ...
    def collide(
        self,
        positions: _Doubles | tuple[_Doubles, _Doubles, _Doubles] | list[_Doubles],
        velocities: _Doubles | tuple[_Doubles, _Doubles, _Doubles] | list[_Doubles],
        *,
        reach: float,
        restitution: float = 0.0,
        friction: float = 0.0,
        threads: int | None = None,
    ) -> Collisions: ...
    def range(self, box: ArrayLike, /) -> tuple[float, float]: ...
    def at(self, time: float) -> Solid: ...
    def between(self, start: float, end: float) -> Solid: ...
    def within(self, box: ArrayLike, /) -> Solid: ...
    def volume(self, cells: int = 96, *, threads: int | None = None) -> float: ...
    def mesh(
        self,
        cells: int | None = None,
        *,
        cell: float | None = None,
        method: Literal["dc", "mc"] = "dc",
        box: ArrayLike | None = None,
        no_slivers: bool = False,
        threads: int | None = None,
    ) -> Mesh: ...
    def slice(
        self,
        *,
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
        samples: int = 320,
        window: tuple[float, float, float, float] | None = None,
        threads: int | None = None,
    ) -> Slice: ...
    def to_c(
        self,
        *,
        header: bool = False,
        sign: bool = False,
        distance: bool = False,
        prefix: str | None = None,
        open_params: bool = False,
    ) -> str: ...
    def to_wgsl(
        self, *, sign: bool = False, distance: bool = False, prefix: str | None = None, open_params: bool = False
    ) -> str: ...
    def to_glsl(
        self, *, sign: bool = False, distance: bool = False, prefix: str | None = None, open_params: bool = False
    ) -> str: ...
    def _repr_svg_(self) -> str | None: ...
    def _repr_html_(self) -> str: ...
    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]: ...

@final
class Mesh:
    @property
    def vertices(self) -> _Doubles: ...
    @property
    def normals(self) -> _Doubles: ...
    @property
    def triangles(self) -> NDArray[np.uint32]: ...
    @property
    def volume(self) -> float: ...
    @property
    def area(self) -> float: ...
    @property
    def closed(self) -> bool: ...
    @property
    def thin_cells(self) -> int: ...
    @property
    def max_distance(self) -> float: ...
    def save(self, path: _Path, *, ascii: bool = False, unit: str = "m") -> None: ...
    # other packages, which need not be installed
    def to_trimesh(self) -> Any: ...
    def to_pyvista(self) -> Any: ...
    def to_meshio(self) -> Any: ...
    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]: ...

@final
class Slice:
    @property
    def omega(self) -> _Doubles: ...
    @property
    def u(self) -> _Doubles: ...
    @property
    def v(self) -> _Doubles: ...
    @property
    def axes(self) -> tuple[str, str]: ...
    @property
    def extent(self) -> tuple[float, float, float, float]: ...
    def svg(self) -> str: ...
    def save(self, path: _Path) -> None: ...
    def _repr_svg_(self) -> str: ...
    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]: ...

@final
class Simulation:
    @property
    def program(self) -> Program: ...
    @property
    def name(self) -> str: ...
    @property
    def warnings(self) -> tuple[Diagnostic, ...]: ...
    @property
    def time(self) -> float: ...
    @property
    def steps(self) -> int: ...
    @property
    def until(self) -> float: ...
    @property
    def particle_mass(self) -> float: ...
    @property
    def spacing(self) -> float: ...
    @property
    def bounds(self) -> _Doubles: ...
    @property
    def positions(self) -> _Doubles: ...
    @property
    def velocities(self) -> _Doubles: ...
    @property
    def density(self) -> _Doubles: ...
    @property
    def pressure(self) -> _Doubles: ...
    @property
    def audit(self) -> Audit: ...
    @property
    def stats(self) -> Stats: ...
    @property
    def probes(self) -> dict[str, dict[str, _Doubles]]: ...
    @property
    def probe_units(self) -> dict[str, dict[str, str]]: ...
    def views(self) -> dict[str, _Array]: ...
    def surface(self, *, cell: float | None = None) -> Mesh: ...
    def step(self, count: int = 1) -> None: ...
    def advance(self, until: float, *, progress: bool = False) -> None: ...
    def save(self, folder: _Path) -> pathlib.Path: ...
    def resume(self, folder: _Path) -> None: ...
    def _repr_html_(self) -> str: ...
    def __len__(self) -> int: ...
