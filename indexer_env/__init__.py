"""The cam indexing machine: motor → reducer → spatial cam with roller followers → rotary table.

Map, in reading order
---------------------
errors, checks, units      one sentence for every mistake; rpm and degrees in SI units
build                      plain mappings to self-checking objects
laws, law_reader           laws of chance for episodes and data sets; from YAML
motion_law                 the cam's law β(α): four classical laws and the user's own table
machine, operating_point   what the machine is, what it is asked to do
effects                    the library of effects the model can be extended by, by name
faults                     faults of the bench as severities, which stand for effects
presets                    machines, operating points and sensors in YAML, each number with unit and reason
law_table, coefficients    from these objects to the plain numbers of the kernels: the only door
kernels                    the physics as plain scalar functions, compiled; the integrator
compiled, engine           one compiled version of everything, announced before it is compiled; all cores
device, cuda               a GPU in their place: the same kernels once more, each machine a thread (extra [cuda])
turns, run                 warm-up turn after turn; how to record
simulate, trajectory       `simulate` one machine, `simulate_batch` thousands; what they return
reference                  the slow, independent solver (SciPy DOP853 stopped at every edge) to check any item
modes                      natural frequencies of the linearised machine, and the step that resolves them
drive_sensors              motor torque, motor current and encoders, sampled with the record
signal, sensors, filters   the record as a measuring chain gives it, with sensor_noise; sensor_stream reads by blocks
fault_law                  how faults come into an episode: drawn, setting in, growing
control, scenario, start   the control task; what an environment is made with; what an episode starts with
fleet                      n machines, one kernel call per control period
env, vector_env, film      the Gymnasium environment of one machine and of many; pictures
registration               their names, given to Gymnasium on import; vector_parts is what those of many share
variation                  the law of varied machines
wrappers, spectrum         one-turn windows, spectra, varied machines and noise around an environment
diagnosis_task, diagnosis  what may be measured and named at what price; what a measured turn shows
diagnosis_env              the Gymnasium environment of active diagnosis; diagnosis_vector_env that of many machines,
                           diagnosis_fleet the core of both
stable_baselines           the vector environment for stable-baselines3; imported by itself, as it needs the extra [rl]
minari_export              episodes as a Minari data set; imported by itself, as it needs the extra [minari]
render                     pictures of a running machine; imported by itself, as it needs the extra [render]

Units: SI and radians everywhere; degrees and rpm only in YAML keys that end in ``_deg`` or ``_rpm``.
Indices: joints are numbered 1 (input), 2 (output), 3 (base); stations 0 … S-1; arrays are (item, sample).
The paper: "Detection of various failure causes in complex mechanical systems by the use of Artificial Neural Networks";
its sections and figures are cited by number. The equations, and what is corrected of its print:
docs/explanation/physics.md.
Signs: δ1 = τγ - α, δ2 = φ - β(α) - θ, δ3 = θ; a backlash is the TOTAL play of its joint.
"""

from indexer_env.effects import EFFECTS, Effect, MachineEffect, SensorEffect, make_effect
from indexer_env.errors import IndexerError, MotionLawWarning, ParameterError, SignalError, SimulationError
from indexer_env.faults import Faults
from indexer_env.machine import Joint, Machine, machine_from_mapping
from indexer_env.modes import Modes, natural_frequencies
from indexer_env.motion_law import MOTION_LAWS, MotionLaw, TableLaw, motion_law
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_machine, load_operating_point, load_sensor
from indexer_env.registration import register_environments
from indexer_env.run import Run
from indexer_env.sensors import Sensor
from indexer_env.signal import Signal
from indexer_env.simulate import simulate, simulate_batch
from indexer_env.trajectory import CHANNELS, Batch, Trajectory, WarmupReport

__all__ = [
    "CHANNELS",
    "EFFECTS",
    "MOTION_LAWS",
    "Batch",
    "Effect",
    "Faults",
    "IndexerError",
    "Joint",
    "Machine",
    "MachineEffect",
    "Modes",
    "MotionLaw",
    "MotionLawWarning",
    "OperatingPoint",
    "ParameterError",
    "Run",
    "Sensor",
    "SensorEffect",
    "Signal",
    "SignalError",
    "SimulationError",
    "TableLaw",
    "Trajectory",
    "WarmupReport",
    "load_machine",
    "load_operating_point",
    "load_sensor",
    "machine_from_mapping",
    "make_effect",
    "motion_law",
    "natural_frequencies",
    "simulate",
    "simulate_batch",
]

register_environments()
