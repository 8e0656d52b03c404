"""What is asked: material, roughness, surface, light, accuracy. Files: `scene_file`."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Self

from .. import memory
from ..errors import InputError
from . import engines, notebook, validators
from .expectation import Expectation

Several = float | Sequence[float]

STRUCTURES = ("independent", "tops", "middle", "extremes")
"""Where the steep facets of a generated surface lie in height."""
BOUNDARIES = ("periodic", "mirror")
LEVELS = ("none", "plane", "quadratic")
VOIDS = ("refuse", "crop", "fill")
"""What is done with points of a measured surface that were not measured."""
MAX_CELLS = 16384
MAX_INDEX = 100.0
"""Largest n and k: beyond, 4/n of the light at most enters, and F is 1 but at grazing."""
CORRELATIONS = (0.5, 1e6)
"""Correlation lengths in cells: below, cells are white noise; above, a period is one parabola."""
BECKMANN = 1e9
"""γ that stands for Beckmann's ∞: the same to nine digits."""
DEFAULT_PATHS = 1_000_000
MOST_PATHS = 10**12
LEAST_ERROR = 1e-6
SPACINGS = (1e-30, 1e30)
"""Spacings in the unit of length: squares of heights and float32 meshes must hold them."""


def _check_cells(cells: Any) -> None:
    """Refuse a number of cells a side that no mesh has, saying what memory it would take."""
    plain = isinstance(cells, int) and not isinstance(cells, bool)
    if plain and MAX_CELLS < cells < 10**9:
        raise InputError(
            f"surface.cells = {cells}: must be 2 … {MAX_CELLS}; {cells} a side would take about "
            f"{memory.gibibytes(cells**2 * memory.TRACE_BYTES_PER_CELL)} of memory, "
            f"{MAX_CELLS} take {memory.gibibytes(MAX_CELLS**2 * memory.TRACE_BYTES_PER_CELL)}"
        )
    validators.integer("surface.cells", cells, 2, MAX_CELLS)


@dataclass(frozen=True)
class Material:
    """Interfaced-Lambertian facet, or a conductor.

    Relative index n in [1, 100] and substrate albedo Kd in [0, 1], by default 0.8;
    several Kd are answered by one trace. An extinction coefficient k in (0, 100] makes
    it a conductor of index n + ik, n in (0, 100], without a substrate (Kd = 0).
    """

    n: float = 1.5
    kd: tuple[float, ...] = ()
    k: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "n", validators.number("material.n", self.n))
        object.__setattr__(self, "k", validators.number("material.k", self.k))
        validators.require(0 <= self.k <= MAX_INDEX, "material.k", self.k, "0 (a dielectric) … 100")
        if self.kd == ():
            object.__setattr__(self, "kd", 0.0 if self.conductor else 0.8)
        object.__setattr__(self, "kd", validators.numbers("material.kd", self.kd))
        for kd in self.kd:
            validators.require(0 <= kd <= 1, "material.kd", kd, "0 … 1")
        if self.conductor:
            validators.require(0 < self.n <= MAX_INDEX, "material.n", self.n, "> 0 … 100 (with k)")
            validators.require(
                self.kd == (0.0,), "material.kd", self.kd, "left out: a conductor has no substrate"
            )
        else:
            validators.require(
                1 <= self.n <= MAX_INDEX, "material.n", self.n, "1 (no interface) … 100"
            )

    @property
    def conductor(self) -> bool:
        """Whether the facet is a conductor, and light that it does not mirror is absorbed."""
        return self.k > 0


@dataclass(frozen=True)
class Roughness:
    """STD slopes: shape γ > 3/2, roughness σ along x and y (one number: isotropic).

    σ = 0 is flat; below 1e−6 a lobe is narrower than float32 directions can tell.
    """

    gamma: float = 2.0
    sigma: tuple[float, ...] = (0.5,)

    def __post_init__(self) -> None:
        object.__setattr__(self, "gamma", validators.number("roughness.gamma", self.gamma))
        object.__setattr__(self, "sigma", validators.numbers("roughness.sigma", self.sigma))
        validators.require(
            self.gamma > 1.5,
            "roughness.gamma",
            self.gamma,
            "> 1.5 (below, the mean slope of the surface is infinite)",
        )
        validators.require(
            len(self.sigma) <= 2, "roughness.sigma", self.sigma, "one number or two (x, y)"
        )
        for sigma in self.sigma:
            validators.require(
                sigma == 0 or 1e-6 <= sigma <= 1000,
                "roughness.sigma",
                sigma,
                "0 (flat) or 1e-6 … 1000",
            )
        validators.require(
            (self.sigma_x > 0) == (self.sigma_y > 0),
            "roughness.sigma",
            self.sigma,
            "both zero (flat) or both positive",
        )

    @property
    def sigma_x(self) -> float:
        """Roughness along x."""
        return self.sigma[0]

    @property
    def sigma_y(self) -> float:
        """Roughness along y."""
        return self.sigma[-1]

    @property
    def isotropic(self) -> bool:
        """Whether both roughnesses are equal."""
        return self.sigma_x == self.sigma_y


@dataclass(frozen=True)
class Surface:
    """The explicit surface: generated, or read from ``file``.

    ``spacing`` is one number, or two along x and y. What a file does not say or offers
    several times is said here: spacing, boundary, channel, height_unit, void_value; how
    to go on with it: voids, level. See `surface.read_surface`.
    """

    cells: int = 512
    correlation: float = 8.0
    structure: str = "independent"
    realisations: int = 4
    file: str | None = None
    spacing: float | tuple[float, ...] | None = None
    boundary: str | None = None
    level: str = "none"
    channel: str | None = None
    voids: str | None = None
    height_unit: str | None = None
    void_value: float | None = None

    def __post_init__(self) -> None:
        _check_cells(self.cells)
        object.__setattr__(
            self, "correlation", validators.number("surface.correlation", self.correlation)
        )
        low, high = CORRELATIONS
        validators.require(
            low <= self.correlation <= high,
            "surface.correlation",
            self.correlation,
            f"{low:g} … {high:g} cells",
        )
        validators.choice("surface.structure", self.structure, STRUCTURES)
        validators.integer("surface.realisations", self.realisations, 1, 10_000)
        if self.spacing is not None:
            spacing = validators.numbers("surface.spacing", self.spacing)
            validators.require(
                len(spacing) <= 2, "surface.spacing", spacing, "one number or two (x, y)"
            )
            low, high = SPACINGS
            for distance in spacing:
                validators.require(
                    low <= distance <= high, "surface.spacing", distance, f"{low:g} … {high:g}"
                )
            object.__setattr__(self, "spacing", spacing if len(spacing) == 2 else spacing[0])
        for name in ("channel", "height_unit"):
            text = getattr(self, name)
            validators.require(
                text is None or isinstance(text, str), f"surface.{name}", text, "a text"
            )
        if self.voids is not None:
            validators.choice("surface.voids", self.voids, VOIDS)
        if self.void_value is not None:
            validators.number("surface.void_value", self.void_value)
        if self.boundary is not None:
            validators.choice("surface.boundary", self.boundary, BOUNDARIES)
        validators.choice("surface.level", self.level, LEVELS)
        named = self.file is None or (isinstance(self.file, str) and self.file != "")
        validators.require(named, "surface.file", self.file, "the name of a file")


@dataclass(frozen=True)
class Light:
    """Directions of incidence in degrees: θ in [0, 90), φ in [−360, 360] from +x."""

    theta: tuple[float, ...] = (0.0, 30.0, 60.0, 80.0)
    phi: tuple[float, ...] = (0.0,)

    @property
    def angles(self) -> int:
        """How many directions there are, each θ with each φ."""
        return len(self.theta) * len(self.phi)

    def __post_init__(self) -> None:
        object.__setattr__(self, "theta", validators.numbers("light.theta", self.theta))
        object.__setattr__(self, "phi", validators.numbers("light.phi", self.phi))
        for theta in self.theta:
            validators.require(0 <= theta < 90, "light.theta", theta, "0 ≤ θ < 90 degrees")
        for phi in self.phi:
            validators.require(-360 <= phi <= 360, "light.phi", phi, "−360 … 360 degrees")
        for name, values in (("light.theta", self.theta), ("light.phi", self.phi)):
            validators.require(
                len(set(values)) == len(values), name, list(values), "without repetition"
            )


@dataclass(frozen=True)
class Accuracy:
    """How much work: paths for each angle and realisation, or the error to reach.

    ``standard_error`` is that of albedos, ``lobe_error`` that of lobes relative to
    themselves (see `precision`), by default the same number. ``engine`` traces, one of
    `engines.ENGINES`; "auto" is kept as None.
    """

    paths: int = DEFAULT_PATHS
    standard_error: float | None = None
    lobe_error: float | None = None
    engine: str | None = None

    def __post_init__(self) -> None:
        if self.engine is not None:
            object.__setattr__(self, "engine", engines.checked(self.engine))
        validators.integer("accuracy.paths", self.paths, 1, MOST_PATHS)
        for name in ("standard_error", "lobe_error"):
            target = getattr(self, name)
            if target is not None:
                number = validators.number(f"accuracy.{name}", target)
                validators.require(
                    LEAST_ERROR <= number <= 1, f"accuracy.{name}", target, "1e-6 … 1"
                )
                object.__setattr__(self, name, number)
        if self.lobe_error is not None and self.standard_error is None:
            raise InputError(
                f"accuracy.lobe_error = {self.lobe_error}: goes with a standard_error; give both"
            )
        if self.standard_error is not None and self.paths != DEFAULT_PATHS:
            raise InputError(
                f"accuracy.paths = {self.paths} and standard_error = {self.standard_error}: "
                "give one of both; paths are then as many as the error takes"
            )

    def with_paths(self, paths: int) -> "Accuracy":
        """So many paths instead, by the same engine."""
        return Accuracy(paths, engine=self.engine)


@dataclass(frozen=True)
class Effects:
    """What to leave out on purpose."""

    multiple_scattering: bool = True

    def __post_init__(self) -> None:
        validators.require(
            isinstance(self.multiple_scattering, bool),
            "effects.multiple_scattering",
            self.multiple_scattering,
            "true or false",
        )


@dataclass(frozen=True)
class Scene:
    """One question to the tool. `Scene.requires` decides what has to run for it."""

    title: str = ""
    rationale: str = ""
    material: Material = field(default_factory=Material)
    roughness: Roughness = field(default_factory=Roughness)
    surface: Surface = field(default_factory=Surface)
    light: Light = field(default_factory=Light)
    accuracy: Accuracy = field(default_factory=Accuracy)
    effects: Effects = field(default_factory=Effects)
    expect: Mapping[str, Expectation] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("title", "rationale"):
            validators.require(
                isinstance(getattr(self, name), str), name, getattr(self, name), "a text"
            )
        for quantity, expected in self.expect.items():
            if len(expected.verdict) not in (1, len(self.light.theta)):
                raise InputError(
                    f"expect.{quantity}.verdict has {len(expected.verdict)} entries: "
                    f"must be one, or one for each of the {len(self.light.theta)} light.theta"
                )

    @classmethod
    def of(
        cls,
        *,
        gamma: float = 2.0,
        sigma: Several = 0.5,
        n: float = 1.5,
        kd: Several = (),
        k: float = 0.0,
        theta: Several = 60.0,
        phi: Several = 0.0,
    ) -> Self:
        """Build a scene from the numbers that most differ: ``Scene.of(gamma=2, sigma=0.5)``.

        All as in `Roughness`, `Material` and `Light` (angles in degrees), one number or several
        where these take several.
        """
        return cls(
            material=Material(n, kd, k),  # type: ignore[arg-type]
            roughness=Roughness(gamma, sigma),  # type: ignore[arg-type]
            light=Light(theta, phi),  # type: ignore[arg-type]
        )  # one number becomes a tuple of one

    def _repr_html_(self) -> str:
        return notebook.sections(asdict(self), self.title)

    @property
    def requires(self) -> "Requirements":
        """Which effects this scene needs; what is not needed is never run."""
        measured = self.surface.file is not None
        return Requirements(
            interface=self.material.n > 1 or self.material.conductor,
            substrate=max(self.material.kd) > 0,
            roughness=measured or self.roughness.sigma_x > 0,
            anisotropy=measured or not self.roughness.isotropic,
            multiple_scattering=self.effects.multiple_scattering,
            azimuth=measured or not self.roughness.isotropic or len(self.light.phi) > 1,
        )


@dataclass(frozen=True)
class Requirements:
    """The effects a scene needs, each false where it would compute a known answer.

    interface: n > 1 or k > 0, else no Fresnel; substrate: some Kd > 0, else no body events;
    roughness: σ > 0, else no mesh; anisotropy: σ_x ≠ σ_y; multiple_scattering:
    light that meets a second facet is followed; azimuth: from where light comes matters,
    else it comes from all sides in turn, and lobes are folded about the plane of incidence.
    """

    interface: bool
    substrate: bool
    roughness: bool
    anisotropy: bool
    multiple_scattering: bool
    azimuth: bool
