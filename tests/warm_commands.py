"""Loaded by a server of forked children: all commands, and so what they load."""

from importlib import import_module

from microsurf.cli.group import COMMANDS

for _name in COMMANDS:
    import_module(f"microsurf.cli.{_name}")
