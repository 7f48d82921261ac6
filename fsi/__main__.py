"""`python -m fsi`."""

from fsi.command import main

main()
