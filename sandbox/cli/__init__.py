"""The command line: commands, tables, exit codes."""

from sandbox.cli.commands import main

__all__ = ["main"]
