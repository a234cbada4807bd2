"""Which way to combine what agents report of an object's class, on simulated reports: log loss of the true class.

    python3 fusion-hub/it/oracles/class_beliefs.py

needs numpy. Agents report a class in each of 30 frames, right with one probability, of the right group with another; a
report repeats the agent's first one with the probability `persists`, because errors last. `shares`: of all reports.
`belief`: as `values/class_belief.rs`. `bayes`: Bayes' rule on each agent's mean report. `bayes/frame`: on every report.
"""

import numpy as np

GROUPS = np.array([0, 0, 0, 1, 1, 2, 2])
N = len(GROUPS)
PRIOR = np.array([0.5, 0.15, 0.05, 0.15, 0.03, 0.08, 0.04])
FRAMES, OBJECTS = 30, 3000
rng = np.random.default_rng(1)


def report(true, right, within):
    kind = rng.random()
    if kind < right:
        return true
    same = GROUPS == GROUPS[true]
    if kind < right + within:
        same[true] = False
        return rng.choice(np.flatnonzero(same))
    return rng.choice(np.flatnonzero(~same))


def belief(shares, laws):
    """Dempster's rule over classes, groups and everything; a group's mass follows its classes. And the conflict."""
    classes, groups, anything, agreed = np.zeros(N), np.zeros(3), 1.0, 1.0
    for share, (right, within) in zip(shares, laws):
        c, g = right * share, np.array([within * share[GROUPS == group].sum() for group in range(3)])
        a = 1 - right - within
        combined = classes * (c + g[GROUPS] + a) + c * (groups[GROUPS] + anything)
        of_groups, rest = groups * (g + a) + anything * g, anything * a
        total = combined.sum() + of_groups.sum() + rest
        classes, groups, anything = combined / total, of_groups / total, rest / total
        agreed *= total
    p = classes.copy()
    for group in range(3):
        members = GROUPS == group
        if classes[members].sum() > 0:
            p[members] += groups[group] * classes[members] / classes[members].sum()
    return p / p.sum() * (1 - anything) + anything / N, 1 - agreed


def confusion(right, within):
    table = np.zeros((N, N))
    for true in range(N):
        same = GROUPS == GROUPS[true]
        table[true, same] = within / max(1, same.sum() - 1)
        table[true, ~same] = (1 - right - within) / (~same).sum()
        table[true, true] = right
    return table


def bayes(weights, laws, likelihood):
    ln = sum(likelihood(confusion(*law), weight) for weight, law in zip(weights, laws))
    p = np.exp(ln - ln.max())
    return p / p.sum()


def run(agents, persists):
    losses = {}
    conflicts = {True: [], False: []}
    for _ in range(OBJECTS):
        true = rng.choice(N, p=PRIOR)
        counts = []
        for law in agents:
            first, count = report(true, *law), np.zeros(N)
            for _ in range(FRAMES):
                count[first if rng.random() < persists else report(true, *law)] += 1
            counts.append(count)
        shares = [count / count.sum() for count in counts]
        combined, conflict = belief(shares, agents)
        conflicts[combined.argmax() == true].append(conflict)
        for name, p in {
            "shares": sum(shares) / len(shares),
            "belief": combined,
            "bayes": bayes(shares, agents, lambda table, share: np.log(table @ share)),
            "bayes/frame": bayes(counts, agents, lambda table, count: np.log(table) @ count),
        }.items():
            p = np.clip(p, 1e-3, 1)
            losses.setdefault(name, []).append(-np.log(p[true] / p.sum()))
    text = "  ".join(f"{name} {np.mean(loss):.3f}" for name, loss in losses.items())
    right, wrong = (np.mean(conflicts[kind]) if conflicts[kind] else float("nan") for kind in (True, False))
    print(f"{agents} persists {persists}: {text}  conflict where right {right:.2f}, wrong {wrong:.2f}")


for agents in [
    [(0.9, 0.08)] * 2,
    [(0.9, 0.08), (0.6, 0.35)],
    [(0.9, 0.08)] * 3,
    [(0.95, 0.04), (0.7, 0.25), (0.7, 0.25)],
]:
    for persists in (0.9, 0.5):
        run(agents, persists)
