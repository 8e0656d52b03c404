"""How commands plan a run: they say on stderr what it will take."""

import click

from ..analysis.planning import Plan, plan
from ..scene import Scene


def planned(scene: Scene, seed: int, workers: int | None, name: str = "") -> Plan:
    """Plan a measurement and tell people, under its name if it is one of several."""
    planned_run = plan(scene, seed=seed, workers=workers, progress=True)
    lines = [name, *(f"  {line}" for line in planned_run.lines())] if name else planned_run.lines()
    click.echo("\n".join(lines), err=True)
    return planned_run
