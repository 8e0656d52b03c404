"""The command line: puts the commands together, and gives every error one line and its code."""

import sys

import click

from . import __version__
from .commands.measure import measure_command
from .commands.plot import plot_command
from .commands.predict import predict_command
from .commands.surface import make_surface
from .commands.validate import validate_command
from .errors import MicrosurfError


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__)
def cli() -> None:
    """Make Student-t microsurfaces, ray-trace them, and compare them with microfacet theory.

    Example: microsurf measure --gamma 2 --sigma 0.5 --theta 60
    """


for _command in (make_surface, measure_command, predict_command, validate_command, plot_command):
    cli.add_command(_command)


def main() -> None:
    """Run the command line with its exit codes: every error is one line on stderr."""
    try:
        code = cli.main(standalone_mode=False)
    except MicrosurfError as error:
        _fail(str(error), error.exit_code)
    except click.ClickException as error:
        _fail(error.format_message(), 2)
    except (KeyboardInterrupt, click.Abort):
        _fail("interrupted", 130)
    except (OSError, MemoryError) as error:
        _fail(f"could not finish: {error or 'out of memory'}", 3)
    sys.exit(code if isinstance(code, int) else 0)


def _fail(message: str, code: int) -> None:
    click.echo("microsurf: " + " ".join(message.split()), err=True)
    sys.exit(code)
