"""What every test needs: no windows, no crowding of the processors, and the same examples on every run."""

import os

# Before torch and matplotlib are imported: they read these once. Test processes already share the cores.
os.environ.setdefault("MPLBACKEND", "Agg")
if "PYTEST_XDIST_WORKER" in os.environ:
    os.environ.setdefault("OMP_NUM_THREADS", "1")

from hypothesis import settings

# No deadline: the first example may compile a kernel. Derandomised: a failure in CI is the same failure here.
settings.register_profile("project", deadline=None, derandomize=True, database=None)
settings.load_profile("project")
