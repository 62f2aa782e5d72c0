"""4. Two classifiers, one of them broken: found, and trusted less.

Two classifiers tell wines apart, each by its own half of the chemical measurements. After training the
second one's instrument is plugged in wrongly: it goes on giving confident probabilities, of the wrong wines.
Fused as they are, the two come out worse than the good one alone.

A few labelled wines show how far each can be trusted. Without labels two sources can't tell which of them is
wrong; with a third one, disagreement shows it.
"""

import numpy as np
from sklearn.datasets import load_wine
from sklearn.linear_model import LogisticRegression
from sklearn.model_selection import train_test_split
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from evifuse.belief import Frame, MassFunction, dempster, discount, pignistic
from evifuse.belief.correct import fit_reliabilities
from evifuse.belief.masses_from import from_probabilities
from evifuse.belief.neighbours import EvidentialNeighbours
from evifuse.belief.reliability import reliability_from_disagreement


def main() -> None:
    wines = load_wine()
    frame = Frame(wines.target_names.tolist())
    labels = wines.target_names[wines.target]
    learn, rest, learn_labels, rest_labels = train_test_split(
        wines.data, labels, test_size=0.5, random_state=0
    )
    check, test, check_labels, test_labels = train_test_split(
        rest, rest_labels, test_size=0.6, random_state=0
    )

    halves = [slice(0, 6), slice(6, 13)]
    models = [make_pipeline(StandardScaler(), LogisticRegression()) for _ in halves]
    for model, half in zip(models, halves, strict=True):
        model.fit(learn[:, half], learn_labels)

    def say(cases: np.ndarray) -> list[MassFunction]:
        good, bad = cases[:, halves[0]], cases[:, halves[1]][:, [6, 5, 4, 3, 2, 1, 0]]  # plugged in wrongly
        both = [model.predict_proba(part) for model, part in zip(models, (good, bad), strict=True)]
        return [from_probabilities(frame, p, reliability=0.99) for p in both]

    def right(m: MassFunction) -> float:
        return float((np.array(frame.hypotheses)[pignistic(m).argmax(axis=1)] == test_labels).mean())

    first, second = say(test)
    print(f"alone:                {right(first):.2f} and {right(second):.2f} right")
    print(f"fused:                {right(dempster(first, second).mass):.2f} right")

    # How far each is to be trusted, from labelled wines that were not learned from.
    trust = [
        float(fit_reliabilities(m, check_labels, contexts=[frame])[frame.hypotheses]) for m in say(check)
    ]
    print(f"reliabilities:        {trust[0]:.2f} and {trust[1]:.2f}")
    both = [discount(m, reliability=t) for m, t in zip((first, second), trust, strict=True)]
    print(f"discounted and fused: {right(dempster(*both).mass):.2f} right")

    # The same without labels, with a third classifier as a witness.
    scaler = StandardScaler().fit(learn)
    witness = EvidentialNeighbours().fit(scaler.transform(learn), learn_labels)
    third = witness.predict_mass(scaler.transform(test))
    found = reliability_from_disagreement([first, second, third])
    print(f"by disagreement:      source {int(found.argmin()) + 1} of 3 is broken", found.round(2).tolist())


if __name__ == "__main__":
    main()
