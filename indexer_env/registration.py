"""Enters the environments into Gymnasium's registry, on `import indexer_env`.

Gymnasium 1.0 took away the entry points by which a plugin could register itself without an import; in their place
``gymnasium.make("indexer_env:indexer_env/Indexer-v1")`` imports the package in the same call.
"""

from __future__ import annotations

from gymnasium.envs.registration import register

MAX_EPISODE_STEPS = 328
"""Control periods of an episode: two table turns of the reference machine (8.2 s each) in periods of 50 ms."""


def register_environments() -> None:
    """Register `indexer_env/Indexer-v1` and `indexer_env/IndexerDiagnosis-v1`."""
    register(
        id="indexer_env/Indexer-v1",
        entry_point="indexer_env.env:IndexerEnv",
        vector_entry_point="indexer_env.vector_env:IndexerVectorEnv",
        max_episode_steps=MAX_EPISODE_STEPS,
    )
    register(
        id="indexer_env/IndexerDiagnosis-v1",
        entry_point="indexer_env.diagnosis_env:IndexerDiagnosisEnv",
        vector_entry_point="indexer_env.diagnosis_vector_env:IndexerDiagnosisVectorEnv",
    )
