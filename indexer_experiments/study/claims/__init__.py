"""The paper's claims, one file each.

    base      what every claim offers
    lines     what the claims that compare variants share
    models    Model A or Model B                                  (§4.1)
    fig4      PSD against FFT, from fine to coarse
    fig5      a thousand starts
    fig6      hidden nodes
    pairs     binary against bipolar targets, logistic against linear outputs (figs. 7 and 8)
    fig9      ten training rules
    table2    six classes with 0.3 % error                        (§4.3)
    fig10     a measured record given to a simulation-trained network
    fig11     the backlash node's output against the play
    on_bench  what the next two share
    fig12     the twenty cases of the bench
    fig13     backlashes that were not taught                     (figs. 13–15)

CLAIMS finds a claim by its key, in the order of the paper; `chosen` reads a choice of them.
"""

from __future__ import annotations

from indexer_env.checks import check_choice
from indexer_env.errors import refuse
from indexer_experiments.study.claims.base import Claim
from indexer_experiments.study.claims.fig4 import Fig4
from indexer_experiments.study.claims.fig5 import Fig5
from indexer_experiments.study.claims.fig6 import Fig6
from indexer_experiments.study.claims.fig9 import Fig9
from indexer_experiments.study.claims.fig10 import Fig10
from indexer_experiments.study.claims.fig11 import Fig11
from indexer_experiments.study.claims.fig12 import Fig12
from indexer_experiments.study.claims.fig13 import Fig13
from indexer_experiments.study.claims.models import Models
from indexer_experiments.study.claims.pairs import Fig7, Fig8
from indexer_experiments.study.claims.table2 import Table2

__all__ = ["CLAIMS", "Claim", "chosen"]

CLAIMS: dict[str, Claim] = {
    claim.key: claim
    for claim in (
        Models(), Fig4(), Fig5(), Fig6(), Fig7(), Fig8(), Fig9(), Table2(), Fig10(), Fig11(), Fig12(), Fig13(),
    )
}  # fmt: skip


def chosen(keys: object) -> tuple[Claim, ...]:
    """The claims of "all", of one key or of a list of keys, in the order of the paper. Raises ParameterError."""
    if keys == "all":
        return tuple(CLAIMS.values())
    wanted = [keys] if isinstance(keys, str) else keys
    if not isinstance(wanted, list) or not wanted:
        raise refuse("study", "claims", f"all, or one or a list of {', '.join(CLAIMS)}", keys)
    for key in wanted:
        check_choice("study", "claims", key, ("all", *CLAIMS))
    return tuple(claim for key, claim in CLAIMS.items() if key in wanted)
