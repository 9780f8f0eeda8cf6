"""The compiled core: plain floats and arrays, no objects, no framework (numpy, math and numba only).

Reading order
-------------
layout         the rows of the workspace: state, coefficients, motion-law piece, stage values
compiling      the decorators
trigonometry   sine and cosine that become vector code
joints         torque of a joint with play and bilinear stiffness; its contact regions and their guards
effects        scalar equations of the model's extensions (friction, ripple, bumps, slip, tables)
interpolation  angles inside a step: a motor on its ramp, the quintic through both ends
drive          what ripples on the reducer's output, and its mesh
dynamics       equations of motion of Models A, B and B on its base as plain scalar functions
rates          accelerations of a whole block of lanes: law, drive, joints, effects, dynamics
nystrom        one step of the Runge-Kutta-Nyström scheme, for every model and effect
plain          the common case, Model B whose motor does not slip: one loop for each stage
pieces         the joints' lines and the law's pieces, loaded into a lane
edges          landing on the edge of a play or of a motion-law segment inside one step
forced         what drives the oscillators of a dwell: harmonics at a steady speed, an imbalance
dwell          the dwell in closed form, in strides of several steps
recording      samples: judged and written
clock          a lane's own clock: how it goes on by steps and by strides, to its end
integrate      blocks of lanes, and `entry`, which makes the one entry point
item           one item alone, from load to unload: a thread of a GPU
control        one control period of a fleet

Conventions: SI units and radians. A *lane* is one machine; LANES machines advance together in a block and every
value is a row of LANES numbers, so each inner loop runs over neighbouring memory and becomes vector code. The scalar
functions (joints, effects, dynamics) know nothing of lanes: a GPU kernel can compile the same ones per thread.
No fast-math: a lane's numbers are the same whatever its neighbours, its place in the batch or the compiler's mood,
and the same as in plain Python (NUMBA_DISABLE_JIT=1).
"""
