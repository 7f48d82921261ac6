"""Pictures and files of a run for other programs: ParaView, videos, the reconstructed free surface."""
