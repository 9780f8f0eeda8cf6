"""The modules of `indexer_env.kernels` once more, as a thread of a GPU runs them.

The folder of `indexer_env.kernels` is searched behind this one, so every module here is the same file as there, but for
`compiling`: one lane, and the decorators of numba's CUDA target. `entries` are the kernels that a GPU is given.
"""

from indexer_env import kernels

__path__.extend(kernels.__path__)
