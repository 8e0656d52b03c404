"""One question to the tool: what is measured and predicted, in memory and in a file."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Self

from ..errors import InputError
from ..files import whole_file
from . import layers as layering
from . import notebook, toml, validators
from .accuracy import Accuracy
from .effects import Effects, Requirements
from .expectation import Expectation
from .layers import Layers
from .light import Light
from .material import Material
from .roughness import Roughness
from .surface import Surface

Several = float | Sequence[float]


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
    layers: Layers | None = None
    expect: Mapping[str, Expectation] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("title", "rationale"):
            validators.require(
                isinstance(getattr(self, name), str), name, getattr(self, name), "a text"
            )
        if self.layers is not None:
            layering.check(self.layers, self.material, self.surface, self.effects, self.accuracy)
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

    @classmethod
    def from_toml(cls, text: str) -> Self:
        """Build a scene from the text of a scene file, as results hold it.

        Raises
        ------
        InputError
            If it is no TOML, a key is unknown, or a value none that may be.

        """
        return cls(**toml.values_of(toml.tables_of(text)))

    @classmethod
    def read(cls, path: str | Path) -> Self:
        """Read a scene file; a relative ``file`` of a surface is looked for beside it.

        If the scene comes from a pipe, it is looked for in the working directory.

        Raises
        ------
        InputError
            If the file can't be read, or as `from_toml`.

        """
        return cls.read_with_tables(path)[0]

    @classmethod
    def read_with_tables(cls, path: str | Path) -> tuple[Self, Mapping[str, Any]]:
        """Read a scene file, and its tables as they stand there, without what is left open."""
        path = Path(path)
        text = toml.read_text(path)
        try:
            scene = cls.from_toml(text)
        except InputError as error:
            raise InputError(f"{path}: {error}") from error
        folder = path.parent if path.is_file() else Path()
        return scene.with_files(lambda file: str(folder / file)), toml.tables_of(text)

    def with_files(self, relocate: Callable[[str], str]) -> Self:
        """The scene with other names for the files of its surfaces."""
        scene = self
        if scene.surface.file is not None:
            scene = replace(
                scene, surface=replace(scene.surface, file=relocate(scene.surface.file))
            )
        if scene.layers is not None and scene.layers.substrate.file is not None:
            substrate = scene.layers.substrate
            under = replace(substrate, file=relocate(str(substrate.file)))
            scene = replace(scene, layers=replace(scene.layers, substrate=under))
        return scene

    def to_toml(self) -> str:
        """Give the text of a scene file; `from_toml` of it gives the same scene."""
        return toml.text_of(asdict(self))

    def write(self, path: str | Path) -> None:
        """Write a scene file, whole or not at all, that `read` makes the same scene of.

        Lines that a file could leave out are marked as defaults. A relative ``file`` of a surface
        is named from the folder of the scene file.

        Raises
        ------
        InputError
            If the file can't be written.
        MicrosurfError
            If there is no room.

        """
        path = Path(path)
        scene = self.with_files(lambda file: _seen_from(path.parent, file))
        text = toml.marked(scene.to_toml(), asdict(scene), asdict(Scene()))
        with whole_file(path) as temporary:
            temporary.write_text(text, encoding="utf-8", newline="\n")

    def _repr_html_(self) -> str:
        return notebook.sections(asdict(self), self.title)

    @property
    def requires(self) -> Requirements:
        """Which effects this scene needs; what is not needed is never run."""
        measured = self.surface.file is not None
        isotropic = self.roughness.isotropic and (
            self.layers is None or self.layers.substrate.isotropic
        )
        return Requirements(
            interface=self.material.n > 1 or self.material.conductor,
            substrate=max(self.material.kd) > 0,
            roughness=measured or self.roughness.sigma_x > 0 or self.layers is not None,
            anisotropy=measured or not isotropic,
            multiple_scattering=self.effects.multiple_scattering,
            azimuth=measured or not isotropic or len(self.light.phi) > 1,
        )


def _seen_from(folder: Path, file: str) -> str:
    """Name a file from a folder as `Scene.read` looks for it: absolute paths stay."""
    path = Path(file)
    if path.is_absolute():
        return file
    if path.is_relative_to(folder):
        return path.relative_to(folder).as_posix()
    # ".." leads out of the folder that links point to.
    return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
