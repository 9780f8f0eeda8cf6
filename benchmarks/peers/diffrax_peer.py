"""diffrax' Tsit5 with adaptive steps, vmapped."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.peers.jax_peer import jax_numpy, rates


def tsit5(sample_rate: float, samples: int, rtol: float) -> Callable[[np.ndarray], np.ndarray]:
    """A compiled function from parameters (n, 13) to records φ̈ [rad/s²] (n, samples); atol = rtol / 1000."""
    jax, jnp = jax_numpy()
    import diffrax

    times = jnp.arange(samples) / sample_rate

    def one(p):
        solution = diffrax.diffeqsolve(
            diffrax.ODETerm(rates), diffrax.Tsit5(), 0.0, times[-1], 1e-4,
            jnp.array([0.0, 1.0, 0.0, 0.0]) * p[12], p,
            saveat=diffrax.SaveAt(ts=times), max_steps=10_000_000,
            stepsize_controller=diffrax.PIDController(rtol=rtol, atol=1e-3 * rtol),
        )  # fmt: skip
        return jax.vmap(lambda t, y: rates(t, y, p)[3])(times, solution.ys)

    return jax.jit(jax.vmap(one))
