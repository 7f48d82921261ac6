"""`python -m fsi`."""

from fsi.cli import main

main()
