"""The fast path of Model B against the general one."""

import numpy as np
import pytest
from numba import njit

from indexer_env.compiled import kernel_fingerprint
from indexer_env.kernels import layout
from indexer_env.kernels.nystrom import nystrom_step
from indexer_env.kernels.plain import plain_step

ROWS_OF_EFFECTS = range(int(layout.DRIVE_EXTRA), int(layout.MESH_FACTOR), int(layout.LANES))
TABLE = (0.3, 1.0, 4.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0)
"""The least that there is: one cell over one variable."""
EDGES = layout.HAS_EDGES_1 | layout.HAS_EDGES_2


def steps(fingerprint: str):
    """Three general steps and three plain ones; `fingerprint` stands for all kernel sources in numba's cache."""

    @njit(error_model="numpy", cache=True)
    def general(w, high, features):
        for _ in range(3):
            nystrom_step(w, high, layout.MODEL_B, features)
        return fingerprint

    @njit(error_model="numpy", cache=True)
    def plain(w, high, features, effects):
        for _ in range(3):
            plain_step(w, high, features, effects)
        return fingerprint

    return general, plain


@pytest.mark.unjitted
@pytest.mark.parametrize("features", [EDGES, EDGES | layout.USES_COULOMB, layout.USES_ANY_EFFECT & ~layout.USES_SLIP])
@pytest.mark.parametrize("count", [int(layout.LANES), 5])
def test_plain_and_general_step_agree_to_the_last_bit(count, features):
    rng = np.random.default_rng(7)
    general = rng.uniform(0.1, 1.0, layout.WORKSPACE)
    general[layout.STEP : layout.STEP + layout.LANES] = 1e-3
    general[layout.HOUSING : layout.HOUSING + 2 * layout.LANES] = 0.0
    general[layout.MESH_FACTOR : layout.MESH_FACTOR + layout.LANES] = 1.0
    general[layout.MOTOR_ACC : layout.MOTOR_ACC + layout.LANES] = general[
        layout.MOTOR_ACCELERATION : layout.MOTOR_ACCELERATION + layout.LANES
    ]
    for k, number in enumerate(TABLE):
        row = layout.TABULATED_FIRST_1 + np.uint64(k) * layout.LANES
        general[row : row + layout.LANES] = number
    for row in ROWS_OF_EFFECTS:
        general[row : row + layout.LANES] = 0.0
    plain = general.copy()
    high = np.uint64(count)
    take_general, take_plain = steps(kernel_fingerprint())
    take_general(general, high, features)
    take_plain(plain, high, features, np.bool_(features & layout.USES_ANY_EFFECT))
    kept = [layout.CAM, layout.CAM_RATE, layout.TABLE, layout.TABLE_RATE, layout.MOTOR, layout.MOTOR_RATE]
    kept += [layout.CAM_ACC, layout.TABLE_ACC, layout.TORQUE_1, layout.TORQUE_2]
    kept += [layout.DEFLECTION_ACC_1, layout.DEFLECTION_ACC_2, layout.DEFLECTION_ACC_1_0, layout.DEFLECTION_ACC_2_0]
    kept += [layout.DEFLECTION_1, layout.DEFLECTION_RATE_1, layout.DEFLECTION_2, layout.DEFLECTION_RATE_2]
    kept += [layout.CAM_0, layout.CAM_ACC_0, layout.TABLE_0, layout.TABLE_ACC_0, layout.MOTOR_0, layout.DEFLECTION_1_0]
    for row in kept:
        np.testing.assert_array_equal(plain[row : row + layout.LANES], general[row : row + layout.LANES])
