"""One run on many processes: MPI ranks, each with a box of the tank (`mpiexec -n 4 fsi run SCENE`).

| module | what it knows |
|---|---|
| `start` | whether this process is one of several, and what those besides the first do without |
| `comm` | messages: `Ranks` |
| `faults` | a rank that fails, dies or hangs ends all of them |
| `decomposition` | boxes of whole slices of cells, and their balance |
| `halo` | which particles a rank holds, its ghosts, and what they are told (`fsi.protocols.Halo`) |
| `reductions` | numbers over the particles of all ranks, the same on every number of them |

Every rank builds the whole scene, keeps the particles in its box and steps all bodies; nothing here is imported by a run in one
process.
"""
