"""One module for each kind of waves: its file is its name, its `Waves` what `fsi.waves.kind` says."""
