"""Cases of waves and wavemakers."""
