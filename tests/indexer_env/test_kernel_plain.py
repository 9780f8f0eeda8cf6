"""The fast path of Model B without effects against the general one."""

import numpy as np
import pytest

from indexer_env.kernels import layout
from indexer_env.kernels.plain import plain_step
from indexer_env.kernels.rk4 import rk4_parts

ROWS_OF_EFFECTS = range(int(layout.DRIVE_EXTRA), int(layout.MESH_FACTOR), int(layout.LANES))


@pytest.mark.unjitted
@pytest.mark.parametrize("lane", [None, 5])
def test_plain_and_general_step_agree_to_the_last_bit(lane):
    rng = np.random.default_rng(7)
    general = rng.uniform(0.1, 1.0, layout.WORKSPACE)
    general[layout.STEP : layout.STEP + layout.LANES] = 1e-3
    general[layout.HOUSING : layout.HOUSING + 2 * layout.LANES] = 0.0
    general[layout.MESH_FACTOR : layout.MESH_FACTOR + layout.LANES] = 1.0
    general[layout.MOTOR_ACC : layout.MOTOR_ACC + layout.LANES] = general[
        layout.MOTOR_ACCELERATION : layout.MOTOR_ACCELERATION + layout.LANES
    ]
    for row in ROWS_OF_EFFECTS:
        general[row : row + layout.LANES] = 0.0
    plain = general.copy()
    low, high = (layout.FIRST_LANE, layout.LANES) if lane is None else (np.int64(lane), np.int64(lane + 1))
    for _ in range(3):
        rk4_parts(general, low, high, layout.MODEL_B, 0)
        plain_step(plain, low, high)
    kept = [layout.CAM, layout.CAM_RATE, layout.TABLE, layout.TABLE_RATE, layout.MOTOR, layout.MOTOR_RATE]
    kept += [layout.CAM_ACC, layout.TABLE_ACC, layout.TORQUE_1, layout.TORQUE_2]
    kept += [layout.DEFLECTION_1, layout.DEFLECTION_RATE_1, layout.DEFLECTION_2, layout.DEFLECTION_RATE_2]
    kept += [layout.CAM_0, layout.CAM_ACC_0, layout.TABLE_0, layout.TABLE_ACC_0, layout.MOTOR_0, layout.DEFLECTION_1_0]
    for row in kept:
        np.testing.assert_array_equal(plain[row : row + layout.LANES], general[row : row + layout.LANES])
