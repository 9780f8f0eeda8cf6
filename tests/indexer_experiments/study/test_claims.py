"""Every claim's lines on rows whose answer is known, and that no verdict is a foregone conclusion."""

import re

import numpy as np
import pytest
from matplotlib.figure import Figure

from classifier.dataset import SUBSETS
from datagen.recipes import order_of
from indexer_env.errors import ParameterError
from indexer_experiments.study import lab
from indexer_experiments.study.claims import CLAIMS, chosen
from indexer_experiments.study.claims import fig11 as fig11_claim
from indexer_experiments.study.claims.fig4 import CUTS, RESOLUTIONS
from indexer_experiments.study.claims.fig6 import HIDDEN
from indexer_experiments.study.claims.fig9 import RULES
from indexer_experiments.study.claims.pairs import HIDDEN as PAIR_HIDDEN
from indexer_experiments.study.settings import DIAGNOSIS
from indexer_experiments.study.verdicts import Verdict, conjunction

SEEDS = range(3)


def table2(error, epochs):
    return [
        {"data_seed": seed, "network": network, "performance": error + 0.01 * network, "best_epoch": epochs + seed}
        | {f"{subset}_{what}": error for subset in SUBSETS for what in ("mse", "misclassified")}
        for seed in SEEDS for network in range(3)
    ]  # fmt: skip


def fig4(trials, psd, fft, coarse):
    levels = {f"FFT to {cut:g} Hz": fft * (coarse if cut < 12.5 else 1) for cut in CUTS}
    return trials(levels | {f"PSD at {step:g} Hz": psd * (coarse if step > 8 else 1) for step in RESOLUTIONS})


def fig5(spread):
    rng = np.random.default_rng(1)
    return [
        {"data_seed": seed, "network": network, "performance": float(0.06 * np.exp(spread * rng.standard_normal()))}
        for seed in SEEDS for network in range(400)
    ]  # fmt: skip


def pair(trials, key, factor):
    claim = CLAIMS[key]
    return trials({
        f"{kind}, {hidden} hidden": 0.1 if kind == claim.first else 0.1 * factor
        for kind in claim.networks for hidden in PAIR_HIDDEN
    })  # fmt: skip


def fig9(trials, poor, slow):
    rows = trials({rule: poor if rule == "trainrp" else 0.1 for rule in RULES}, spread=0.01)
    return [row | {"seconds": slow if row["variant"] == "trainoss" else 0.01} for row in rows]


def fig11(power):
    plays = np.linspace(0, 1e-3, 11)
    return [
        {"data_seed": seed, "play": float(play), "network": network, "output": float(1.0 / (1.0 + np.exp(-9 * x)))}
        if power is None else {"data_seed": seed, "play": float(play), "network": network, "output": float(x**power)}
        for seed in SEEDS for network in range(2) for play, x in zip(plays, np.linspace(0, 1, 11), strict=True)
    ]  # fmt: skip


def bench(cases, errors):
    """Answers on all twenty cases, off by the case's error at backlashes not taught, the roller too; 8 data sets."""
    rows = []
    for seed in range(8):
        for (case, levels), error in zip(cases.items(), errors, strict=True):
            for roller, screws, level in np.ndindex(2, 2, 5):
                off = 0.0 if level in levels else error * (1 + 0.01 * seed)
                target = 0.25 * level
                rows.append({
                    "data_seed": seed, "variant": case, "roller": roller, "screws": screws,
                    "level": level, "taught": level in levels,
                    "target_roller": roller, "target_screws": screws, "target_backlash": target,
                    "output_roller": abs(roller - off), "output_screws": float(screws), "output_backlash": target + off,
                    "wrong": off > 0.125, "wrong_share_of_networks": float(off > 0.125),
                    "backlash_error_of_networks": off + 1e-3,
                })  # fmt: skip
    return rows


def fig10(*said):
    return [
        {"data_seed": seed, "expected": "11100", "said": code, "right_share_of_networks": 0.5}
        | {f"output_{node}": 0.9 for node in range(5)}
        for seed, code in enumerate(said)
    ]


def models(fast, soft, heavy):
    return [
        {"data_seed": seed, "variant": name, "misfit_A": 0.01 * gain, "misfit_B": 0.01, "gain": gain + 0.1 * seed}
        for seed in SEEDS for name, gain in {"plain": 5.0, "fast": fast, "soft": soft, "heavy": heavy}.items()
    ]  # fmt: skip


ALL = {"all backlashes taught": (0, 1, 2, 3, 4)}
NONE = {"all backlashes taught": ()}
ABC = {"case a": (0, 4), "case b": (0, 2, 4), "case c": (0, 1, 3, 4)}
PLAIN = {
    "models": (lambda t: models(10.0, 9.0, 2.0), lambda t: models(10.0, 9.0, 20.0)),
    "table2": (lambda t: table2(0.001, 170), lambda t: table2(0.1, 20)),
    "fig4": (lambda t: fig4(t, 0.05, 0.1, 3.0), lambda t: fig4(t, 0.1, 0.05, 1.0)),
    "fig5": (lambda t: fig5(0.4), lambda t: fig5(1.5)),
    "fig6": (lambda t: t(dict.fromkeys(map(str, HIDDEN), 0.1), 0.005), lambda t: t({str(h): 0.9**h for h in HIDDEN})),
    "fig7": (lambda t: pair(t, "fig7", 2.0), lambda t: pair(t, "fig7", 0.5)),
    "fig8": (lambda t: pair(t, "fig8", 2.0), lambda t: pair(t, "fig8", 0.5)),
    "fig9": (lambda t: fig9(t, 0.3, 0.1), lambda t: fig9(t, 0.05, 0.01)),
    "fig10": (lambda t: fig10(*["11100"] * 8), lambda t: fig10(*["11110"] * 8)),
    "fig11": (lambda t: fig11(1.0), lambda t: fig11(12.0)),
    "fig12": (lambda t: bench(ALL, (0.0,)), lambda t: bench(NONE, (0.6,))),
    "fig13": (lambda t: bench(ABC, (0.3, 0.2, 0.1)), lambda t: bench(ABC, (0.1, 0.2, 0.3))),
}  # fmt: skip
"""Rows that each claim agrees with, and rows that it does not."""

REFUTED = {
    "models": {2}, "table2": {0, 1}, "fig4": {0, 1, 3, 5}, "fig5": {0}, "fig6": {0, 1}, "fig7": {0, 1}, "fig8": {0, 1},
    "fig9": {0, 2, 3}, "fig10": {0}, "fig11": {1}, "fig12": {0}, "fig13": {0, 1, 2},
}  # fmt: skip
"""Places of the lines that the second rows of each claim refute."""


def test_every_claim_is_here():
    assert set(PLAIN) == set(CLAIMS)


@pytest.mark.parametrize("key", PLAIN)
def test_a_verdict_follows_from_the_rows(key, trials):
    agreeing, other = (CLAIMS[key].judge(make(trials)) for make in PLAIN[key])
    assert conjunction(agreeing) is Verdict.REPRODUCED, agreeing
    assert {i for i, line in enumerate(other) if line.verdict is Verdict.NOT_REPRODUCED} == REFUTED[key], other
    assert [line.says for line in agreeing] == [line.says for line in other]


@pytest.mark.parametrize("key", PLAIN)
def test_a_line_is_told_in_words_and_one_sentence(key, trials):
    for make in PLAIN[key]:
        for line in CLAIMS[key].judge(make(trials)):
            assert line.paper and line.rule and line.says
            assert re.fullmatch(r"[A-Z0-9].*[.]", line.why) and "nan" not in line.why, line.why


def test_a_network_that_is_kept_as_it_began_has_an_interval():
    """Kept at epochs 0, 1 and 2: the mean is that of 1, 1 and 2, and all numbers are finite."""
    _, epochs = CLAIMS["table2"].judge(table2(0.001, 0))
    assert epochs.ours.mean == pytest.approx(2 ** (1 / 3))
    assert np.isfinite([epochs.ours.low, epochs.ours.high]).all()
    assert epochs.verdict is Verdict.NOT_REPRODUCED and epochs.why == "From 0 to 2 epochs."


def test_numbers_that_help_to_understand_a_line(trials):
    """The sentences beside the lines, on rows whose numbers are known."""
    why = {key: [line.why for line in CLAIMS[key].judge(make[0](trials))] for key, make in PLAIN.items()}
    assert why["models"][2] == "Model A leaves 2 % and Model B leaves 1 % of the record."
    assert why["table2"] == [
        "The best network of each data set misclassifies 0.1 % of the records.",
        "From 170 to 172 epochs.",
    ]
    assert "11100 on 8 of 8 data sets; of all networks 50 % give the expected one." in why["fig10"][0]
    assert why["fig12"] == ["100 % of the cases are right, of single records 100 %."]
    assert why["fig13"][2] == "Mean error where not taught: 31.1 % in case a, 20.8 % in case b, 10.5 % in case c."
    assert why["fig9"][0].startswith("Of ten rules trainrp is number 10, the worst other rule is train")
    assert why["fig11"][1] == "The output reaches one half at 50 % of the largest play."
    assert "With each error on its targets' own scale the ratio would be 0.5." in why["fig7"][0]


@pytest.mark.parametrize(
    ("outputs", "said"),
    [
        (np.linspace(0.0, 0.3, 11), "at no play."),
        (np.linspace(0.0, 1.0, 11), "at 50 % of the largest play."),
        ((0.0, 0.2, 0.6, 0.4, 0.2, 0.6, 0.6, 0.6, 0.6, 0.6, 0.6), "at 18 % of the largest play."),
    ],
)
def test_one_half_is_reached_where_the_output_first_rises_to_it(outputs, said):
    rows = [
        {"data_seed": seed, "network": 0, "play": 1e-4 * step, "output": float(output)}
        for seed in SEEDS for step, output in enumerate(outputs)
    ]  # fmt: skip
    assert CLAIMS["fig11"].judge(rows)[1].why == f"The output reaches one half {said}"


def test_the_play_is_told_on_machines_that_taught_none(tmp_path, monkeypatch):
    """Recipes of one seed have the same machines, so that the sweep of plays has another seed."""
    asked = []

    def asked_for(recipe, seed, folder):
        asked.append(order_of(recipe, seed))
        return tmp_path

    def stop(folder):
        raise InterruptedError

    monkeypatch.setattr(lab, "make", asked_for)
    monkeypatch.setattr(lab.Lab, "train", lambda *_: None)
    monkeypatch.setattr(fig11_claim, "labelled_by_code", lambda _: None)
    monkeypatch.setattr(fig11_claim, "read", stop)
    with pytest.raises(InterruptedError):
        CLAIMS["fig11"].collect(lab.Lab(lab.Size(2, 1, 0, 1), 0, tmp_path), DIAGNOSIS[0])
    paths = ("input_joint.stiffness", "output_joint.stiffness")
    taught, judged = (
        {
            tuple(order.campaign.item(k, order.base, order.seed).machine.get(path) for path in paths)
            for k in range(order.count)
        }
        for order in asked
    )
    assert taught and judged and not taught & judged


@pytest.mark.parametrize("key", CLAIMS)
def test_a_claim_says_what_the_paper_says_and_is_drawn(key, trials):
    claim = CLAIMS[key]
    assert claim.key == key and len(claim.says) > 40 and claim.where.startswith("§") and claim.choices
    assert len(claim.settings) > 1
    assert len({setting.key for setting in claim.settings}) == len(claim.settings)
    figure = Figure()
    axes = list(figure.subplots(1, claim.panels, squeeze=False).flatten())
    rows = PLAIN[key][0](trials)
    if key == "table2":
        rows = [row | {"variant": "network"} for row in rows]
    claim.draw(axes, rows)
    assert all(ax.get_ylabel() and ax.lines for ax in axes)


def test_claims_are_chosen_in_the_order_of_the_paper():
    assert [claim.key for claim in chosen("all")] == list(CLAIMS)
    assert [claim.key for claim in chosen(["fig9", "fig4"])] == ["fig4", "fig9"]
    assert [claim.key for claim in chosen("fig5")] == ["fig5"]
    for wrong, words in ((["fig44"], "did you mean 'fig4'"), ([], "all"), (4, "all"), ([4], "one of")):
        with pytest.raises(ParameterError, match="claims must be") as caught:
            chosen(wrong)
        assert words in str(caught.value)
