"""The command line: maps in, E and B out, and a summary of what was done.

`commands` says what may be asked, `requests` holds what was asked, `inputs` reads it, `separation`
does it, `outputs`, `pictures` and `summary` tell the result, `progress` tells how far it is.
Nothing heavy is imported before a command runs.
"""

from __future__ import annotations

from spinsdw.cli.commands import main

__all__ = ["main"]
