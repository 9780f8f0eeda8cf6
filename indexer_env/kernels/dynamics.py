"""Equations of motion (docs/explanation/physics.md, section The machine) as plain scalar functions; symbols as there.

b0, b1, b2 are β, β', β''; w is α̇; M1, M2, M3 the joints' torques; T_L everything that opposes the table.
"""

from __future__ import annotations

from .compiling import scalar


@scalar
def follower_law(x, c0, c1, c2, c3, c4, c5):
    """β, β' and β'' of one piece of the motion law at x = α - origin [rad]."""
    q = x * x  # in two levels rather than Horner's five: lanes wait for each product
    b0 = (c0 + c1 * x) + q * ((c2 + c3 * x) + q * (c4 + c5 * x))
    b1 = (c1 + 2.0 * c2 * x) + q * ((3.0 * c3 + 4.0 * c4 * x) + q * (5.0 * c5))
    b2 = (2.0 * c2 + 6.0 * c3 * x) + q * (12.0 * c4 + 20.0 * c5 * x)
    return b0, b1, b2


@scalar
def table_acceleration(J_t, T_L, M2):
    """J_t φ̈ = -(T_L + M2), the same in all three models."""
    return -(T_L + M2) * (1.0 / J_t)  # the quotient is the same in all stages


@scalar
def cam_acceleration(J_C, J_F, b1, b2, w, M1, M2):
    """Model B: (J_C + J_F β'²) α̈ = M1 + β' (M2 - J_F β'' α̇²)."""
    return (M1 + b1 * (M2 - J_F * b2 * w * w)) * (1.0 / (J_C + J_F * b1 * b1))  # divided while M2 is worked out


@scalar
def cam_and_housing_acceleration(J_C, J_F, J_b, b1, b2, w, M1, M2, M3):
    """Model B on its base, both rows solved for (α̈, θ̈)::

    (J_C + J_F β'²) α̈ + J_F β' θ̈    = M1 + β' M2 - J_F β' β'' α̇²
    J_F β' α̈         + (J_F + J_b) θ̈ = M2 - M3 - J_F β'' α̇²
    """
    inertia = J_F * b2 * w * w
    m11, m12, m22 = J_C + J_F * b1 * b1, J_F * b1, J_F + J_b
    q1, q2 = M1 + b1 * (M2 - inertia), M2 - M3 - inertia
    determinant = m11 * m22 - m12 * m12
    return (m22 * q1 - m12 * q2) / determinant, (m11 * q2 - m12 * q1) / determinant
