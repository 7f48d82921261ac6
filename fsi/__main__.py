"""`python -m fsi`."""

from fsi.start import main

main()
