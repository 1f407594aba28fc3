"""``python -m coverdrive`` is the command ``coverdrive``."""

from coverdrive.cli import main

main()
