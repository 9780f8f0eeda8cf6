"""Wrappers of `IndexerEnv` for what not every user wants: windows, spectra, varied machines, noise."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.utils import RecordConstructorArgs, seeding

from indexer_env.checks import check_integer, check_number
from indexer_env.env import IndexerEnv
from indexer_env.errors import refuse
from indexer_env.machine import Machine
from indexer_env.presets import load_machine
from indexer_env.spectrum import density, level
from indexer_env.variation import check_half_width, variation_rng, varied

LEVELS = (-120.0, 80.0)
"""Bounds of a spectrum's level [dB over 1 (unit of the reading)²/Hz]; what lies beyond is clipped."""

MOST_WINDOW = 10_000_000
"""Samples in a window: 40 MB in every observation."""

Step = tuple[Any, float, bool, bool, dict[str, Any]]


def _indexer(owner: str, env: gymnasium.Env) -> IndexerEnv:
    if not isinstance(env.unwrapped, IndexerEnv):
        raise refuse(owner, "env", "an IndexerEnv or a wrapper of one", env)
    return env.unwrapped


class TurnWindow(gymnasium.Wrapper, RecordConstructorArgs):
    """The observation is the record of the last table turn: its readings over the sensor's range, oldest first.

    Shape (n,), float32 in [-1, 1], n the samples of `turns` table turns at nominal speed. Before as many have been
    read, the first reading stands for those that are missing.

    Parameters
    ----------
    env : gymnasium.Env
        An IndexerEnv or a wrapper of one.
    turns : float
        Length [table turns], > 0 and at most MOST_WINDOW samples.
    """

    def __init__(self, env: gymnasium.Env, turns: float = 1.0) -> None:
        RecordConstructorArgs.__init__(self, turns=turns)
        gymnasium.Wrapper.__init__(self, env)
        check_number("TurnWindow", "turns", turns, low=0.0, low_open=True)
        self.turns = turns
        indexer = _indexer("TurnWindow", env)
        duration = indexer.machine.turn_duration(indexer.operating_point)
        samples = turns * duration * indexer.task.sample_rate
        if samples > MOST_WINDOW:
            rule = f"at most {MOST_WINDOW / (duration * indexer.task.sample_rate):.3g}, {MOST_WINDOW} samples"
            raise refuse("TurnWindow", "turns", rule, turns)
        self._limit = indexer.limits.acceleration
        self._window = np.zeros(max(1, round(samples)), dtype=np.float32)
        self.observation_space = Box(-1.0, 1.0, self._window.shape)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Fill the window with the episode's first reading."""
        _, info = self.env.reset(seed=seed, options=options)
        self._window.fill(info["acceleration"][-1] / self._limit)
        return self._window.copy(), info

    def step(self, action: Any) -> Step:
        """Append the period's readings to the window."""
        _, reward, terminated, truncated, info = self.env.step(action)
        if not terminated:
            new = info["acceleration"][-len(self._window) :]
            self._window[: -len(new)] = self._window[len(new) :].copy()
            self._window[-len(new) :] = new / self._limit
        return self._window.copy(), float(reward), terminated, truncated, info


class PowerSpectrum(gymnasium.Wrapper, RecordConstructorArgs):
    """The observation is the power spectral density of the last table turn, in 1 Hz steps from 0 Hz, as a level in dB.

    10 log10(P / 1 unit²/Hz) of Welch's method with Hann windows of 1 s, half overlapping, clipped to LEVELS; unit is
    that of the sensor's reading. Shape (highest_hz + 1,), float32.

    Parameters
    ----------
    env : gymnasium.Env
        An IndexerEnv or a wrapper of one.
    highest_hz : int
        Last frequency [Hz], at most half the sample rate, which must be a whole number of Hz.
    turns : float
        Length of the record [table turns]; at least 1 s long.
    """

    def __init__(self, env: gymnasium.Env, highest_hz: int = 100, turns: float = 1.0) -> None:
        RecordConstructorArgs.__init__(self, highest_hz=highest_hz, turns=turns)
        # made again from its spec it is given the window that it made for itself
        window = env if isinstance(env, TurnWindow) and env.turns == turns else TurnWindow(env, turns)
        gymnasium.Wrapper.__init__(self, window)
        indexer = _indexer("PowerSpectrum", env)
        self._rate = indexer.task.sample_rate
        if self._rate != round(self._rate):
            raise refuse("PowerSpectrum", "env", "sampled at a whole number of Hz", f"{self._rate:g} Hz")
        check_integer("PowerSpectrum", "highest_hz", highest_hz, low=1, high=int(self._rate / 2.0))
        space = self.env.observation_space
        assert space.shape is not None
        if space.shape[0] < self._rate:
            raise refuse("PowerSpectrum", "turns", "long enough for a window of 1 s", turns)
        self._limit, self._lines = indexer.limits.acceleration, int(highest_hz) + 1
        self.observation_space = Box(*LEVELS, (self._lines,))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """The spectrum of the episode's first window."""
        window, info = self.env.reset(seed=seed, options=options)
        return self._level(window), info

    def step(self, action: Any) -> Step:
        """The spectrum of the window that ends now."""
        window, reward, terminated, truncated, info = self.env.step(action)
        return self._level(window), float(reward), terminated, truncated, info

    def _level(self, window: np.ndarray) -> np.ndarray:
        record = self._limit * window.astype(np.float64)
        return level(density(record, self._rate, self._lines), LEVELS).astype(np.float32)


class DomainRandomisation(gymnasium.Wrapper, RecordConstructorArgs):
    """Every episode has a machine of its own, drawn by the law of `variation.varied`: ±10 % for w = 0.1.

    The machine that is varied is the environment's, or that of the option "machine". `reset(seed=…)` seeds these draws
    too. The native vector environment does the same for each of its items, by its argument `half_width`.

    Parameters
    ----------
    env : gymnasium.Env
        An IndexerEnv or a wrapper of one.
    half_width : float
        w [-], in [0, 0.5].
    """

    def __init__(self, env: gymnasium.Env, half_width: float = 0.1) -> None:
        RecordConstructorArgs.__init__(self, half_width=half_width)
        gymnasium.Wrapper.__init__(self, env)
        check_half_width("DomainRandomisation", half_width)
        self._rng: np.random.Generator | None = None
        self._half_width, self._machine = half_width, _indexer("DomainRandomisation", env).machine

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Draw the episode's machine."""
        if options and not isinstance(options, Mapping):
            raise refuse("DomainRandomisation.reset", "options", "a mapping", options)
        given = dict(options or {})
        machine = given.get("machine", self._machine)
        if isinstance(machine, str | Path):
            machine = load_machine(machine)
        if seed is not None:
            seeding.np_random(seed)  # refuses what is no seed as Gymnasium does
        if seed is not None or self._rng is None:
            self._rng = variation_rng(seed)
        if isinstance(machine, Machine):
            given["machine"] = varied(machine, self._half_width, self._rng)
        return self.env.reset(seed=seed, options=given)


class SensorNoise(gymnasium.Wrapper, RecordConstructorArgs):
    """White Gaussian noise on every reading, in the observation and in info["acceleration"], clipped to the range.

    One standard normal per sample of the period, times σ = density · √(sample rate / 2). At a reset the reading at
    t = 0 alone gets noise.

    Parameters
    ----------
    env : gymnasium.Env
        An IndexerEnv, or a wrapper of one that leaves its observation as it is.
    density : float
        One-sided [unit of the reading per √Hz], >= 0.
    """

    _rng: np.random.Generator | None = None

    def __init__(self, env: gymnasium.Env, density: float) -> None:
        RecordConstructorArgs.__init__(self, density=density)
        gymnasium.Wrapper.__init__(self, env)
        check_number("SensorNoise", "density", density, low=0.0, unit="unit of the reading/sqrt(Hz)")
        indexer = _indexer("SensorNoise", env)
        if env.observation_space != indexer.observation_space:
            rule = "one whose observation is still that of IndexerEnv"
            raise refuse("SensorNoise", "env", rule, env, "put the noise on before windows and spectra")
        self._limit = indexer.limits.acceleration
        self._sigma = density * math.sqrt(indexer.task.sample_rate / 2.0)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Seed the noise with the episode."""
        rng = self._draws(seed)
        observation, info = self.env.reset(seed=seed, options=options)
        readings = info["acceleration"]
        readings[:] = self._noisy(readings[-1:], rng)
        observation[0] = readings[-1] / self._limit
        return observation, info

    def step(self, action: Any) -> Step:
        """Add noise to the period's readings."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        readings = info["acceleration"]
        readings[:] = self._noisy(readings, self._draws(None))
        if not terminated:
            observation[0] = readings[-1] / self._limit
        return observation, float(reward), terminated, truncated, info

    def _draws(self, seed: int | None) -> np.random.Generator:
        """The generator PCG64(SeedSequence(seed, spawn_key=(2,))), kept until the next seed: apart from the
        environment's and from that of the machines."""
        if seed is not None:
            seeding.np_random(seed)  # refuses what is no seed as Gymnasium does
        if seed is not None or self._rng is None:
            self._rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(2,)))
        return self._rng

    def _noisy(self, readings: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        return np.clip(readings + self._sigma * rng.standard_normal(readings.size), -self._limit, self._limit)
