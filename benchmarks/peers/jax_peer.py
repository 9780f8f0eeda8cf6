"""A JAX scan of classical RK4 in structure-of-arrays form: clipped contact law, closed-form modified sine, float64."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.session import CORES


@functools.cache
def jax_numpy() -> tuple[Any, Any]:
    """The modules jax and jax.numpy, in float64, one device per core (split_over_cores)."""
    flag = f"--xla_force_host_platform_device_count={CORES}"
    os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} {flag}".strip()
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    jax.config.update("jax_platforms", "cpu")
    return jax, jnp


def rates(t: Any, y: Any, p: Any) -> Any:
    """Right-hand side of the state (α, α̇, φ, φ̇), (4,) from parameters (13,)."""
    _, jnp = jax_numpy()
    return jnp.stack(derivatives(t, y, p))


def derivatives(t: Any, y: Any, p: Any) -> tuple[Any, Any, Any, Any]:
    """The same of four numbers, or of four arrays (n,) with parameters 13 × (n,)."""
    b0, b1, b2 = _law(y[0], p[9], p[10])
    m1 = _contact_torque(p[12] * t - y[0], p[12] - y[1], p[3], p[4], p[5])
    m2 = _contact_torque(y[2] - b0, y[3] - b1 * y[1], p[6], p[7], p[8])
    cam = (m1 + b1 * (m2 - p[1] * b2 * y[1] ** 2)) / (p[0] + p[1] * b1**2)
    return y[1], cam, y[3], -(p[11] + m2) / p[2]


def _law(alpha: Any, advance: Any, share: Any) -> tuple[Any, Any, Any]:
    _, jnp = jax_numpy()
    turns = jnp.floor(alpha / (2.0 * jnp.pi))
    s = jnp.minimum((alpha / (2.0 * jnp.pi) - turns) / share, 1.0)
    late = s > 0.5
    u = jnp.where(late, 1.0 - s, s)
    early = u <= 0.125
    angle = jnp.where(early, 4.0 * jnp.pi * u, 4.0 * jnp.pi * u / 3.0 + jnp.pi / 3.0)
    sine, cosine = jnp.sin(angle), jnp.cos(angle)
    y = (jnp.where(early, 0.0, 2.0) + jnp.pi * u - jnp.where(early, 0.25, 2.25) * sine) / (4.0 + jnp.pi)
    v = jnp.pi * (1.0 - jnp.where(early, 1.0, 3.0) * cosine) / (4.0 + jnp.pi)
    a = 4.0 * jnp.pi**2 * sine / (4.0 + jnp.pi)
    y, a = jnp.where(late, 1.0 - y, y), jnp.where(late, -a, a)
    per_rad = 1.0 / (2.0 * jnp.pi * share)
    return advance * (turns + y), advance * per_rad * v, advance * per_rad**2 * a


def _contact_torque(deflection: Any, rate: Any, k: Any, r: Any, edge: Any) -> Any:
    _, jnp = jax_numpy()
    plus = jnp.maximum(k * (deflection - edge) + r * rate, 0.0)
    minus = jnp.minimum(k * (deflection + edge) + r * rate, 0.0)
    return jnp.where(deflection > edge, plus, jnp.where(deflection < -edge, minus, 0.0))


def scan(sample_rate: float, samples: int, steps_per_sample: int) -> Callable[[np.ndarray], np.ndarray]:
    """A compiled function from parameters (n, 13) to records φ̈ [rad/s²] (n, samples)."""
    jax, jnp = jax_numpy()
    h = 1.0 / (sample_rate * steps_per_sample)

    def moved(y, share, k):
        return tuple(value + share * h * rate for value, rate in zip(y, k, strict=True))

    def all_machines(rows):
        p = tuple(rows.T)

        def step(y, t):
            a = derivatives(t, y, p)
            b = derivatives(t + h / 2.0, moved(y, 0.5, a), p)
            c = derivatives(t + h / 2.0, moved(y, 0.5, b), p)
            d = derivatives(t + h, moved(y, 1.0, c), p)
            ends = tuple(
                value + h / 6.0 * (i + 2.0 * (j + k) + m) for value, i, j, k, m in zip(y, a, b, c, d, strict=True)
            )
            return ends, a[3]

        def sample(y, number):
            times = number / sample_rate + h * jnp.arange(steps_per_sample)
            y, accelerations = jax.lax.scan(step, y, times)  # unrolled it is slower
            return y, accelerations[0]

        zero = jnp.zeros_like(p[12])
        return jax.lax.scan(sample, (zero, p[12], zero, zero), jnp.arange(samples, dtype=float))[1].T

    return jax.jit(all_machines)


def split_over_cores(p: np.ndarray) -> Any:
    """Parameters (n, 13) with an equal part of their rows on each core; n a multiple of the cores."""
    jax, _ = jax_numpy()
    mesh = jax.sharding.Mesh(np.array(jax.devices()[:CORES]), ("machines",))
    rows = jax.sharding.NamedSharding(mesh, jax.sharding.PartitionSpec("machines"))
    return jax.device_put(p, rows)
