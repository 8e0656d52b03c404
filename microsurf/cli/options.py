"""Options that commands share, and the scene they make together."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from ..analysis import planning
from ..analysis.tradeoff.effort import EFFORTS
from ..errors import InputError
from ..files import check_readable
from ..scene import ENGINES, Accuracy, Scene, tail_limit


class _Input(click.Path):
    """A path to read; - is what is piped in, as for other programs."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        return super().convert("/dev/stdin" if value == "-" else value, param, ctx)


class Listing(click.Option):
    """An option whose help names the entries of a list, whatever it holds when it is shown."""

    def __init__(self, *names: Any, listing: Callable[[], list[str]], **given: Any) -> None:
        super().__init__(*names, **given)
        self._listing = listing

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """Say what there is now."""
        self.help = "; ".join(self._listing()) + "."
        return super().get_help_record(ctx)


PATH = click.Path(path_type=Path)
INPUT = _Input(path_type=Path)
_MAX_WORKERS = 1024
_MESH = {"cells", "correlation"}
_OF_MADE_SURFACES = ("gamma", "sigma", "sigma_y", "cells", "correlation", "structure")


def _numbers(
    _: click.Context, parameter: click.Parameter, value: str | None
) -> tuple[float, ...] | None:
    """One number, or several separated by commas."""
    if value is None:
        return None
    try:
        return tuple(float(part) for part in value.split(","))
    except ValueError as error:
        raise click.BadParameter(
            f"{value!r} is not a number, nor numbers separated by commas", param=parameter
        ) from error


def _many(name: str, text: str) -> Callable[..., Any]:
    return click.option(name, callback=_numbers, metavar="NUMBER[,NUMBER…]", help=text)


def together(*options: Callable[..., Any]) -> Callable[..., Any]:
    """Stack options that several commands share, in the order they read in --help."""

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        for option in reversed(options):
            command = option(command)
        return command

    return decorate


wavelengths = _many("--wavelengths", "Wavelengths of several Kd in nm, ascending.")
as_json = click.option("--json", "as_json", is_flag=True, help="Print one JSON object on stdout.")
seed = click.option("--seed", type=click.IntRange(0), default=0, show_default=True)
workers = click.option(
    "--workers", type=click.IntRange(1, _MAX_WORKERS), help="Threads; default all cores."
)
allow_truncated_tail = click.option(
    "--allow-truncated-tail",
    is_flag=True,
    help=f"Allow γ < {tail_limit.LEAST_GAMMA:g}, where a finite mesh truncates the slope tail.",
)
resume = click.option(
    "--resume",
    is_flag=True,
    help="Go on with a run that was stopped, from `unfinished` in the folder --out: what is "
    "finished and still fits (scene, seed, options, version) is not done again, and the result is "
    "the same.",
)
effort = click.option(
    "--effort",
    type=click.Choice(list(EFFORTS)),
    default="quick",
    show_default=True,
    help="quick: about a minute on two cores; full: finer meshes, more rays and surfaces.",
)
of_file = together(
    _many("--spacing", "Side of its cells, or DX,DY, if the file does not say."),
    click.option("--boundary", help="How it goes on beyond its edge: periodic or mirror."),
    click.option("--level", help="Take out its trend first: none, plane or quadratic."),
    click.option("--channel", help="Name or number of the file's channel of heights."),
    click.option("--voids", help="Points not measured: refuse, crop or fill."),
    click.option("--height-unit", help="Of heights, if the file does not say: nm, or 0.5nm."),
    click.option("--void-value", type=float, help="The height that marks a void."),
)
of_brdf = together(
    click.option(
        "--material",
        help="interfaced-lambertian (the default), conductor or lambertian+conductor.",
    ),
    click.option(
        "--anisotropic", is_flag=True, default=None, help="σ along two axes, and their azimuth."
    ),
    click.option("--aperture", type=float, help="Full angle of the detector's cone in degrees."),
    click.option("--orders", help="1: closed form alone; all, the default: later orders too."),
    _many("--hold-out", "Incidences in degrees to judge by. Default 30,60."),
    click.option("--margin", type=float, help="Departure of a zone that still fits, 0.15."),
    click.option("--walks", type=int, help="For each pair, of later orders. Default 1000."),
    click.option(
        "--seed", type=click.IntRange(0, 2**64 - 1), help="Same seed, same walks. Default 0."
    ),
    click.option("--pairs", type=PATH, help="Write the measured pairs: FILE.csv."),
)
light = together(
    _many("--theta", "Incidence θ in degrees, e.g. 0,30,60."),
    _many("--phi", "Azimuth of incidence in degrees, from +x."),
)
roughness = together(
    click.option("--gamma", type=float, help="Shape γ of the slopes, > 1.5; 2 is GGX."),
    click.option("--sigma", type=float, help="Roughness σ ≥ 0 (along x)."),
    click.option("--sigma-y", type=float, help="Roughness along y, if another."),
)
material = together(
    click.option("--n", type=float, help="Relative index ≥ 1; 1 = no interface. Default 1.5."),
    _many("--kd", "Substrate albedo 0 … 1, or several. Default 0.8."),
    click.option("--k", type=float, help="Extinction coefficient: a conductor of index n + ik."),
)
accuracy = together(
    click.option("--paths", type=int, help="For each angle and realisation. Default 1000000."),
    click.option(
        "--standard-error",
        type=float,
        help="Of albedos, instead of paths: trace until it is reached.",
    ),
    click.option(
        "--lobe-error",
        type=float,
        help="The same of lobes, relative to themselves. Default that of albedos.",
    ),
    click.option(
        "--engine",
        cls=Listing,
        listing=lambda: [
            "What traces: auto",
            *(f"{key}, which {entry.what}" for key, entry in ENGINES.items()),
        ],
    ),
)
dry_run = click.option(
    "--dry-run", is_flag=True, help="Only say what would run, and what it costs."
)
generated = together(
    click.option(
        "--cells", type=int, help="Cells a side. Default 512, or what --standard-error takes."
    ),
    click.option("--correlation", type=float, help="Correlation length in cells. Default 8."),
    click.option("--structure", help="How heights and slopes are related. Default independent."),
)


def check_described(file: Path | None, given: dict[str, Any]) -> None:
    """Refuse options that leave the roughness open; only a scene file has a default for it."""
    if file is None and (
        given["sigma"] is None or (given["sigma"] != 0 and given["gamma"] is None)
    ):
        raise InputError("no --gamma and --sigma: give both, or a SCENE.toml")


def check_from_file(scene: Scene, given: dict[str, Any]) -> None:
    """Refuse options that a surface from a file leaves without effect, and a file not there."""
    file = scene.surface.file
    if file is None:
        return
    check_readable(Path(file), "`microsurf surface --out FILE` writes one")
    for name in _OF_MADE_SURFACES:
        if given.get(name) is not None:
            raise InputError(
                f"--{name.replace('_', '-')} = {given[name]}: the surface is {file}; leave it out"
            )
    if given.get("realisations") not in (None, 1):
        raise InputError(
            f"--realisations = {given['realisations']}: {file} is one surface; leave it out"
        )


def say(notes: list[str]) -> dict[str, list[str]]:
    """Say notes on stderr, also for --json; as what is printed of them there."""
    for note in notes:
        click.echo(f"microsurf: note: {note}", err=True)
    return {"notes": notes} if notes else {}


def check_tail(scene: Scene, allow_truncated_tail: bool) -> dict[str, str]:
    """Refuse what no mesh can hold, or say on stderr what it leaves out; also for --json."""
    left_out = tail_limit.tail_left_out(scene)
    if left_out is None:
        return {}
    if not allow_truncated_tail:
        raise InputError(
            f"{left_out}; must be ≥ {tail_limit.LEAST_GAMMA:g}. Add "
            "--allow-truncated-tail to accept that error; "
            "`microsurf predict` needs no mesh"
        )
    click.echo(f"microsurf: {left_out}: accepted by --allow-truncated-tail", err=True)
    return {"truncated_tail": left_out}


def compose(file: Path | None, choose_mesh: bool = False, **given: Any) -> Scene:
    """Build the scene of a command: its file, if any, with the options over it.

    ``choose_mesh``: on the mesh that the accuracy takes, unless the file or an option names one.
    """
    base, tables = Scene.read_with_tables(file) if file else (Scene(), {})

    def over(part: Any, **values: Any) -> Any:
        return replace(part, **{k: v for k, v in values.items() if v is not None})

    sigma = given.get("sigma")
    if given.get("sigma_y") is not None:
        sigma = (base.roughness.sigma_x if sigma is None else sigma, given["sigma_y"])
    if given.get("theta") is not None and base.expect:
        base = replace(base, expect={})  # what a scene expects is said for its own angles
    kd = given.get("kd")
    if kd is None and given.get("k"):
        kd = ()  # a conductor has no substrate, whatever the base's
    surface_file = given.get("surface_file")
    scene = replace(
        base,
        material=over(base.material, n=given.get("n"), kd=kd, k=given.get("k")),
        roughness=over(base.roughness, gamma=given.get("gamma"), sigma=sigma),
        surface=over(
            base.surface,
            cells=given.get("cells"),
            correlation=given.get("correlation"),
            structure=given.get("structure"),
            realisations=given.get("realisations"),
            file=str(surface_file) if surface_file else None,
            spacing=given.get("spacing"),
            boundary=given.get("boundary"),
            level=given.get("level"),
            channel=given.get("channel"),
            voids=given.get("voids"),
            height_unit=given.get("height_unit"),
            void_value=given.get("void_value"),
        ),
        light=over(base.light, theta=given.get("theta"), phi=given.get("phi")),
        accuracy=_accuracy(base.accuracy, given),
    )
    named = {name for name in _MESH if given.get(name) is not None}
    named |= _MESH & set(tables.get("surface", {}))
    return planning.with_mesh(scene) if choose_mesh and not named else scene


def _accuracy(base: Accuracy, given: dict[str, Any]) -> Accuracy:
    """Paths asked for take the place of an error, and the other way round."""
    paths, error, lobes = (given.get(key) for key in ("paths", "standard_error", "lobe_error"))
    if given.get("engine") is not None:
        base = replace(base, engine=given["engine"])
    if paths is not None:
        if error is not None or lobes is not None:
            name, value = ("standard", error) if error is not None else ("lobe", lobes)
            raise InputError(
                f"--paths {paths} and --{name}-error {value}: give one of both; "
                "paths are then as many as the error takes"
            )
        return base.with_paths(paths)
    if error is not None:
        kept = base.lobe_error if lobes is None else lobes
        return Accuracy(standard_error=error, lobe_error=kept, engine=base.engine)
    return base if lobes is None else replace(base, lobe_error=lobes)
