"""What `validate` does for each scene, in whatever process, and for how many at a time."""

from dataclasses import dataclass
from typing import Any

from .. import memory, model, report
from ..analysis import validate_user_brdf
from ..analysis.stages import Run
from ..analysis.validate import validate_scene
from ..analysis.validation import Validation
from ..report import sections
from ..scene import Scene
from ..surface import StdFit
from ..trace import embree, work_items
from . import side_by_side


@dataclass(frozen=True)
class SceneJob:
    """What is done for each scene, in this process or another."""

    scenes: dict[str, Scene]
    prepared: dict[str, tuple[StdFit | None, list[str]]]
    surface_paths: dict[str, int]
    user_brdf: tuple[model.UserBrdf, dict[str, list[str]]] | None
    run: Run
    page: report.Report
    options: dict[str, Any]
    workers: int

    def __call__(
        self, name: str, tell: side_by_side.Tell | None
    ) -> tuple[Validation, report.Drawn]:
        """Validate a scene and draw what the page shows of it."""
        options = self.options | {"surface_paths": self.surface_paths.get(name)}
        stages = self.run.of_scene(self.scenes[name], **options)
        stages.tell = tell
        entry = validate_scene(
            name,
            self.scenes[name],
            workers=self.workers,
            progress=tell is None,
            prepared=self.prepared[name],
            stages=stages,
            **options,
        )
        if self.user_brdf is not None:
            brdf, broken = self.user_brdf
            entry = validate_user_brdf.judge(entry, brdf, broken[name])
        if tell is not None:
            tell("report")
        return entry, self.page.draw(entry, sections.of_scene(entry, self.page.slug(name)))


def at_once(scenes: list[Scene], workers: int | None) -> int:
    """How many scenes may be done at the same time: as cores and memory go, one if in doubt."""
    if not side_by_side.possible() or any(s.surface.file is not None for s in scenes):
        return 1
    most = max(
        4 * s.surface.cells**2 * memory.EXACT_BYTES_PER_CELL  # a refined surface
        + s.surface.realisations * s.light.angles * memory.BYTES_PER_LOBE
        for s in scenes
    )
    fit = int(memory.available() // most)
    return max(min(workers or memory.cores(), len(scenes), fit), 1)


def compile_apart(number: int) -> None:
    """Where nothing is compiled yet, have every second process begin with other kernels."""
    if number % 2:
        if embree.installed():
            work_items.compiled("embree")
        for key in model.all_orders():
            model.walk(Scene(), key, walks=2, workers=1)
