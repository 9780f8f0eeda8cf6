"""How long tests wait for other processes."""

PATIENCE = 900.0
"""s; ten times what any of them takes on a machine that is not busy, its compilation included."""
