"""The commands, one a file, put together."""

import click

from .. import __version__
from .advise import advise_command
from .convergence import convergence_command
from .export import export_command
from .fit import fit_command
from .measure import measure_command
from .plot import plot_command
from .predict import predict_command
from .stability import stability_command
from .surface import make_surface
from .tradeoff import tradeoff_command
from .validate import validate_command


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__)
def cli() -> None:
    """Make Student-t microsurfaces, ray-trace them, and compare them with microfacet theory.

    Example: microsurf measure --gamma 2 --sigma 0.5 --theta 60
    """


for _command in (
    make_surface,
    measure_command,
    predict_command,
    validate_command,
    convergence_command,
    stability_command,
    tradeoff_command,
    advise_command,
    plot_command,
    fit_command,
    export_command,
):
    cli.add_command(_command)
