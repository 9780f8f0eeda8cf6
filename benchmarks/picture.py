"""The work–precision picture: error against time of a turn, one line of best settings per solver."""

from __future__ import annotations

from pathlib import Path

from benchmarks.work_precision import Point

PICTURE = Path(__file__).parent / "work_precision.png"

_MARKERS = "osv^DP*X"


def best(points: list[Point]) -> list[Point]:
    """The settings no other setting of the same solver beats in both error and time, from fast to slow."""
    front: list[Point] = []
    for point in sorted(points, key=lambda point: (point.seconds_per_turn, point.error)):
        if not front or point.error < front[-1].error:
            front.append(point)
    return front


def draw(points: list[Point], path: Path = PICTURE) -> None:
    """Draw all solvers into a PNG."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(8.0, 5.5), layout="constrained")
    for number, solver in enumerate(dict.fromkeys(point.solver for point in points)):
        front = best([point for point in points if point.solver == solver])
        axes.loglog(
            [1e3 * point.seconds_per_turn for point in front], [point.error for point in front],
            marker=_MARKERS[number % len(_MARKERS)], label=solver,
            linewidth=2.5 if number == 0 else 1.2, color="black" if number == 0 else f"C{number - 1}",
        )  # fmt: skip
    axes.set_xlabel("time of one table turn on two cores [ms]")
    axes.set_ylabel("relative rms error of φ̈, first 0.5 s [-]")
    axes.set_title("Model B with play in both joints: lower left is better")
    axes.grid(True, which="major", alpha=0.4)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    figure.savefig(path, dpi=130, metadata={"Software": None})
    pyplot.close(figure)
