"""The baselines of the diagnosis task: their mathematics, their rules, and a short run that they must win."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.stats

from benchmarks.diagnosis import belief as model
from benchmarks.diagnosis import page
from benchmarks.diagnosis.belief import Belief
from benchmarks.diagnosis.evaluate import Row, _interval, told
from benchmarks.diagnosis.learned import LearnedPolicy
from benchmarks.diagnosis.measured import Measured, measured
from benchmarks.diagnosis.play import play_in, play_measured
from benchmarks.diagnosis.policies import FixedTurns, GreedyInformation, Known, Policy, RandomPolicy
from indexer_env.diagnosis_env import IndexerDiagnosisEnv

COSTS = np.array([0.1, 0.1, 0.3])


def toy(count: int, seed: int) -> Measured:
    """Four names, three settings: the first tells the names' tens, the second their ones, the third is noise.

    The cases of a name share no more than that; each has an offset of its own at the first two settings.
    """
    rng = np.random.default_rng(seed)
    names = rng.integers(4, size=count)
    levels = rng.standard_normal((count, 3, 4))
    levels[:, 0, 0] += 8.0 * (names // 2)
    levels[:, 1, 0] += 8.0 * (names % 2)
    levels[:, :2, 1] += 5.0 * rng.standard_normal(count)[:, None]
    return Measured(names, levels)


@pytest.fixture(scope="module")
def learned() -> Belief:
    return Belief(toy(3000, 0))


def test_a_belief_is_bayes_rule(learned):
    """Against SciPy's densities of the joint Gaussians, components and all."""
    cases = toy(20, 1)
    z = learned.projected(cases.levels)
    d = learned.dimension
    places = [*range(0, d), *range(2 * d, 3 * d)]
    joint = np.array([
        scipy.stats.multivariate_normal(mean[places], covariance[np.ix_(places, places)]).logpdf(
            z[:, [0, 2]].reshape(20, -1)
        )
        for mean, covariance in zip(learned._means, learned._covariances, strict=True)
    ]).T  # fmt: skip
    expected = np.exp(joint + learned._log_prior)
    expected /= expected.sum(axis=1, keepdims=True)
    for order in ((0, 2), (2, 0)):
        np.testing.assert_allclose(np.exp(learned.log_weights(order, z)), expected, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(np.exp(learned._log_prior).reshape(4, model.COMPONENTS).sum(axis=1), 0.25)


def test_information_of_a_known_case(learned):
    """A bit at the first and second setting, nothing at the third; nothing more where it is known already."""
    policy, cases = GreedyInformation(learned, COSTS, 0.5), toy(50, 2)
    z = learned.projected(cases.levels)
    nothing = learned.log_weights((), z)
    assert [policy._information((), s, z, nothing)[0] for s in range(3)] == pytest.approx([1.0, 1.0, 0.0], abs=0.1)
    once = learned.log_weights((0,), z)
    assert policy._information((0,), 1, z, once) == pytest.approx(np.ones(50), abs=0.1)
    both = learned.log_weights((0, 1), z)
    assert policy._information((0, 1), 2, z, both) == pytest.approx(np.zeros(50), abs=0.05)


def test_greedy_takes_what_tells_and_then_stops(learned):
    cases = toy(200, 3)
    done = play_measured(GreedyInformation(learned, COSTS, 0.5), cases, COSTS, 1.0, 0)
    assert done.right.mean() > 0.98
    np.testing.assert_allclose(done.cost, 0.2)
    idle = play_measured(GreedyInformation(learned, COSTS, 0.05), cases, COSTS, 1.0, 0)
    assert idle.turns.max() == 0 and 0.1 < idle.right.mean() < 0.4
    poor = play_measured(GreedyInformation(learned, COSTS, 0.5), cases, COSTS, 0.15, 0)
    np.testing.assert_array_equal(poor.turns, 1)
    assert 0.35 < poor.right.mean() < 0.65


def test_what_the_budget_does_not_pay_is_a_wrong_name(learned):
    done = play_measured(FixedTurns("", learned, (0, 1, 2)), toy(50, 4), COSTS, 0.2, 0)
    assert not done.right.any() and set(done.turns) == {2}
    np.testing.assert_allclose(done.returns(1.0, 2.0), -2.0 - 0.2)


def test_told_is_per_setting_and_name(learned):
    shares = told(learned, [toy(500, 5), toy(500, 6)])
    assert shares.shape == (3, 4)
    assert shares[:2].mean(axis=1) == pytest.approx([0.5, 0.5], abs=0.1)


def test_an_interval_is_student_s():
    mean, half = _interval([0.1, 0.2, 0.4, 0.2, 0.1])
    low, high = scipy.stats.t.interval(0.95, 4, mean, scipy.stats.sem([0.1, 0.2, 0.4, 0.2, 0.1]))
    assert (mean - half, mean + half) == pytest.approx((low, high))


class Scripted(Policy):
    """The same actions, whatever is known; keeps what it was shown."""

    label = "scripted"

    def __init__(self, actions: list[int]) -> None:
        self.actions, self.shown = actions, []

    def act(self, known: Known, rng: np.random.Generator) -> np.ndarray:
        self.shown.append(known[np.arange(len(known))])  # a copy: the arrays go on to be filled
        return np.full(len(known), self.actions[len(self.shown) - 1])


def test_the_environment_and_measured_cases_play_by_the_same_rules():
    """A turn, then one that the budget does not pay; and what the policy is shown in between."""
    env = IndexerDiagnosisEnv(speeds=[1.3], brakes=[0.0, 200.0], budget=0.08)
    inside, beside = Scripted([0, 1]), Scripted([0, 1])
    played = play_in(env, inside, 1, seed=3)
    copied = play_measured(beside, Measured(np.array([0]), np.zeros((1, 2, 25))), env.costs, 0.08, 0)
    for name in ("right", "cost", "turns"):
        np.testing.assert_allclose(getattr(played, name), getattr(copied, name))
    for one, other in zip(inside.shown, beside.shown, strict=True):
        np.testing.assert_array_equal(one.taken, other.taken)
        np.testing.assert_array_equal(one.affordable, other.affordable)
    env.reset(seed=3)
    np.testing.assert_array_equal(inside.shown[1].levels[0, 0], env.step(0)[0][:25])


def test_cases_do_not_depend_on_their_number():
    env = IndexerDiagnosisEnv(speeds=[1.3], brakes=[0.0])
    few, more = measured(env, 2, 9), measured(env, 3, 9)
    np.testing.assert_array_equal(few.levels, more.levels[:2])
    np.testing.assert_array_equal(few.names, more.names[:2])


def test_a_page_s_tables_hold_every_row():
    pair = (0.5, 0.1)
    results = {
        "size": {"seeds": 5, "cases": 10, "episodes": 2}, "names": ["a", "b"], "settings": ["fast"],
        "rows": [vars(Row("one fixed turn", "fast", pair, pair, pair, pair))], "told": [[0.25, 1.0]],
    }  # fmt: skip
    text = page.tables(results)
    assert "| one fixed turn: fast | 50.0 ± 10.0 % | 0.500 ± 0.100 | 0.500 ± 0.100 | 0.500 ± 0.100 |" in text
    assert "| fast | 25 | 100 |" in text


@pytest.mark.slow
def test_greedy_beats_every_fixed_turn_in_a_short_run():
    """On the environment's own task: more right names than any fixed turn at the cost of the best, and more return.

    1000 cases, seeds from 0: of 250 the best fixed turn may by chance come within 0.05 of it.
    """
    env = IndexerDiagnosisEnv()
    belief, cases = Belief(measured(env, 800, 1000)), measured(env, 1000, 0)

    def play(policy: Policy) -> tuple[float, float, float]:
        done = play_measured(policy, cases, env.costs, env.task.budget, 0)
        return float(done.right.mean()), float(done.cost.mean()), float(done.returns(1.0, 1.0).mean())

    fixed = [play(FixedTurns("", belief, (s,))) for s in range(len(env.settings))]
    right, cost, total = play(GreedyInformation(belief, env.costs, 0.2))
    best = max(fixed)
    assert right > best[0] and cost < best[1]
    assert total > max(each[2] for each in fixed) + 0.05
    assert total > play(RandomPolicy(len(env.names)))[2] + 1.0
    assert max(each[0] for each in fixed) < 0.9  # no single turn tells all
    inside = play_in(env, GreedyInformation(belief, env.costs, 0.2), 60, seed=5)
    assert abs(inside.right.mean() - right) < 0.2  # 60 episodes: four standard errors


def test_a_learned_policy_takes_what_tells_and_then_stops(learned):
    """As greedy information does on the toy, with nobody telling it what a bit is worth."""
    policy = LearnedPolicy(learned, toy(12000, 7), COSTS, 1.0, 1.0, 1.0, seed=0)
    done = play_measured(policy, toy(300, 8), COSTS, 1.0, 0)
    assert done.right.mean() > 0.97
    np.testing.assert_allclose(done.cost, 0.2)
    # Four names guessed are worth -0.5, two turns and the right name 1 - 20·0.1.
    dear = LearnedPolicy(learned, toy(12000, 7), 10.0 * COSTS, 50.0, 1.0, 1.0, seed=0)
    assert play_measured(dear, toy(300, 8), 10.0 * COSTS, 50.0, 0).turns.max() == 0
    poor = play_measured(policy, toy(300, 8), COSTS, 0.15, 0)
    np.testing.assert_array_equal(poor.turns, 1)
