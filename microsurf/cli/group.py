"""The commands, one a file, each loaded when it is called: together they take a second and a half.

``name`` is the command `name_command` in the file ``name.py`` beside this one.
"""

from collections import UserDict
from importlib import import_module
from typing import Any

import click

from .. import __version__

COMMANDS = {
    "advise": "Find the cheapest method whose error stays below a tolerance.",
    "convergence": "Refine mesh, tile, surfaces and rays: what does each leave?",
    "export": "Write a material for other programs.",
    "fit": "Fit Student's t-distribution to a measured surface or BRDF.",
    "measure": "Ray-trace a surface and print its albedos.",
    "plot": "Draw the lobes of results in the plane of incidence.",
    "predict": "Print what the theory alone says.",
    "stability": "Check every formula at extremes against 50-digit arithmetic.",
    "surface": "Make a heightfield with slopes of Student's t-distribution.",
    "tradeoff": "Run every model, walk and mesh, and show what accuracy costs.",
    "validate": "Measure, predict, compare, and write the report.",
}
"""Each command, and what `microsurf --help` says of it."""


class _Commands(UserDict[str, Any]):
    """Loads a command when it is looked up."""

    def __getitem__(self, name: str) -> Any:
        if name not in self:
            raise KeyError(name)
        return getattr(import_module(f".{name}", __package__), f"{name}_command")


class _Group(click.Group):
    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Say what there is, and load none."""
        del ctx
        with formatter.section("Commands"):
            formatter.write_dl([*COMMANDS.items()])


@click.group(
    cls=_Group,
    commands=_Commands(COMMANDS),
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.version_option(__version__)
def cli() -> None:
    """Make Student-t microsurfaces, ray-trace them, and compare them with microfacet theory.

    Example: microsurf measure --gamma 2 --sigma 0.5 --theta 60
    """
