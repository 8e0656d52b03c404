"""Models on the command line: what --model takes, and the list of them in the help."""

import click

from ..model import MODELS
from ..model.registry import entry_of


class ModelKey(click.ParamType[str]):
    """A key of `model.registry`, whatever it holds when the command runs."""

    name = "model"

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str:
        """All of them."""
        del param, ctx
        return f"[{'|'.join(MODELS)}]"

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Refuse what is no key."""
        del param, ctx
        return entry_of(value, MODELS, "--model").key


class ListsModels(click.Command):
    """A command whose help says what each model is."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List them after the options."""
        del ctx
        with formatter.section("Models"):
            formatter.write_dl(
                [(key, f"{entry.what} (orders: {entry.orders})") for key, entry in MODELS.items()]
            )
