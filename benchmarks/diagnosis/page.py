"""The tables of docs/reference/environments/indexer_diagnosis.md and the picture beside them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.diagnosis.evaluate import Row

ROOT = Path(__file__).parents[2]
RESULTS = Path(__file__).parent / "results.json"
PAGE = ROOT / "docs" / "reference" / "environments" / "indexer_diagnosis.md"
PICTURE = ROOT / "docs" / "pictures" / "diagnosis_baselines.png"

_MARKERS = {
    "random": "x", "one fixed turn": "o", "best two fixed turns": "D", "greedy information": "s",
    "learned": "P", "in the environment": "*", "all turns": "^",
}  # fmt: skip


def tables(results: dict[str, Any]) -> str:
    """Both tables, from what the results file holds."""
    size = results["size"]
    lines = [
        f"Mean over {size['seeds']} seeds of {size['cases']} episodes each ({size['episodes']} where it plays in the "
        "environment itself) ± the 95 % interval of that mean (Student's t over the seeds).",
        "",
        "| policy | right names | cost | measurements | return |",
        "| --- | --- | --- | --- | --- |",
    ]
    for values in results["rows"]:
        row = Row(**values)
        label = f"{row.kind}: {row.label}" if row.kind.endswith(("turn", "turns")) else row.label
        percent = f"{100 * row.accuracy[0]:.1f} ± {100 * row.accuracy[1]:.1f} %"
        numbers = [f"{mean:.3f} ± {half:.3f}" for mean, half in (row.cost, row.turns, row.returns)]
        lines.append(f"| {label} | {percent} | {' | '.join(numbers)} |")
    lines += [
        "",
        "Right names after one turn, by setting and truth [%]:",
        "",
        "| setting | " + " | ".join(results["names"]) + " |",
        "| --- |" + " --- |" * len(results["names"]),
    ]
    for setting, shares in zip(results["settings"], results["told"], strict=True):
        lines.append(f"| {setting} | " + " | ".join(f"{100 * share:.0f}" for share in shares) + " |")
    return "\n".join(lines)


def draw(results: dict[str, Any], path: Path = PICTURE) -> None:
    """Right names against cost of all policies, as a PNG."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(8.0, 5.0), layout="constrained")
    rows = [Row(**values) for values in results["rows"]]
    for kind, marker in _MARKERS.items():
        of_kind = sorted((row for row in rows if row.kind == kind), key=lambda row: row.cost[0])
        axes.errorbar(
            [row.cost[0] for row in of_kind], [100.0 * row.accuracy[0] for row in of_kind],
            xerr=[row.cost[1] for row in of_kind], yerr=[100.0 * row.accuracy[1] for row in of_kind],
            marker=marker, linestyle="-" if kind == "greedy information" else "none", label=kind, capsize=2.0,
        )  # fmt: skip
    axes.set_xlabel("cost of the measurements of an episode [reward]")
    axes.set_ylabel("right names [%]")
    axes.set_title("IndexerDiagnosis-v1: upper left is better")
    axes.set_xscale("log")
    axes.set_xticks([0.05, 0.1, 0.2, 0.5, 1.0])
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("")
    axes.grid(True, which="both", alpha=0.4)
    axes.legend(loc="lower right")
    figure.savefig(path, dpi=130, metadata={"Software": None})
    pyplot.close(figure)
