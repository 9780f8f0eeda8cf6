"""What the search finds in the measured EMPS drive: ``python -m benchmarks.emps DATA_EMPS.mat [known effect …]``

The file is that of nonlinearbenchmark.org. The base model has inertia and the effects named. Each round prints a
line for each candidate: level on the cycle fitted and on the one held out, relative force error, parameters.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from discrepancy import explain
from discrepancy.emps import EFFECTS, load_emps


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    parser.add_argument("known", nargs="*", help="effects of the base model: " + ", ".join(EFFECTS))
    options = parser.parse_args()
    model, held_out = load_emps(options.file)
    for name in options.known:
        hypothesis = model.hypotheses()[name][0]
        model, held_out = model.extended(hypothesis), held_out.extended(hypothesis)
    answer = explain(model, held_out)
    for found in answer.rounds:
        for c in found.candidates:
            hypothesis, z = c.place.hypothesis, c.place.z
            parameters = zip(model.parameters + hypothesis.parameters, z, strict=True)
            values = ", ".join(f"{p.name} {p.value(x):.4g} {p.unit}" for p, x in parameters)
            error = model.relative_error(hypothesis, z), held_out.relative_error(hypothesis, z)
            print(f"{c.name:20s} {c.level:7.2f} {c.held_out:7.2f}  {error[0]:.2%} {error[1]:.2%}  {values}")
        print(f"-> {found.verdict}: {', '.join(found.names)}; {found.reason}")
        best = found.candidates[0].place.hypothesis
        model, held_out = model.extended(best), held_out.extended(best)
    print(f"{answer.verdict}: {' + '.join(answer.names)}; gap closed on the cycle held out {answer.closed_share:.1%}")


if __name__ == "__main__":
    main()
