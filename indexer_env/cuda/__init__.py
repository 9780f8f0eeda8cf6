"""The simulator on a GPU, by numba's CUDA target (extra [cuda]); imported only where a `device` asks for it.

Map, in reading order
---------------------
device    the GPU that a `device` names, arrays on it, launches
kernels   the modules of indexer_env.kernels for one thread, and the kernels that call them
turns     packs of machines run on it, for `simulate_batch`
fleet     machines under control on it, for the vector environment
sensor_stream  a sensor read block by block on it
arrays    what the vector environment does with tensors in place of arrays

Arrays stand on the device as torch tensors whose first index, the item, is the fastest. With NUMBA_ENABLE_CUDASIM=1 in
the environment numba's simulator takes the place of the GPU, the tensors are torch's of the CPU, and all runs as plain
Python: for tests.
"""
