"""Run the command line as ``python -m spinsdw.cli``."""

from __future__ import annotations

from spinsdw.cli.commands import main

if __name__ == "__main__":
    main()
