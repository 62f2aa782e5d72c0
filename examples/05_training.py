"""5. Prototypes learned from cases, one source that breaks, and a knowledge base that a person can read.

Two sensors look at handwritten digits: one sees the upper half, the other the lower half. Each learns what
its half says about the digit; prototypes of the digits are learned from that evidence. Then the lower sensor
is plugged in wrongly. Dempster's rule goes on being sure of what both together say; conductivities, which add
up, leave more room for the sensor that still works. Last, sensors that see half of their cells.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from sklearn.datasets import load_digits
from sklearn.model_selection import train_test_split

from evifuse.belief import dempster, pignistic
from evifuse.conductivity import ConductivityClassifier
from evifuse.knowledge import load_knowledge, save_knowledge


def main() -> None:
    cells, digits = load_digits(return_X_y=True)
    learn, test, learn_digits, truth = train_test_split(
        cells, digits, train_size=400, stratify=digits, random_state=0
    )
    halves = [range(32), range(32, 64)]
    model = ConductivityClassifier(sources=halves).fit(learn, learn_digits)

    def judge(name: str, cases: np.ndarray) -> None:
        joint = pignistic(dempster(*model.source_evidence(cases)).mass)
        for rule, p in (("conductivity", model.predict_proba(cases)), ("Dempster", joint)):
            brier = ((p - np.eye(10)[truth]) ** 2).sum(axis=1).mean()
            print(f"{name:<16} {rule:<13} {(p.argmax(axis=1) == truth).mean():.3f} right, Brier {brier:.3f}")

    rng = np.random.default_rng(0)
    broken = test.copy()
    broken[:, 32:] = test[rng.permutation(len(test)), 32:]  # the lower half of another digit
    blind = np.where(rng.random(test.shape) < 0.5, np.nan, test)
    judge("as learned:", test)
    judge("lower is broken:", broken)
    judge("half is missing:", blind)

    # What was learned is a knowledge base: save it, read it, change it.
    upper = model.knowledge_[0]
    with TemporaryDirectory() as folder:
        file = Path(folder) / "upper.yaml"
        save_knowledge(upper, file)
        again = load_knowledge(file)
        lines = file.read_text(encoding="utf-8").splitlines()
    print(
        f"the upper half's knowledge: {len(lines)} lines, read back the same:", again.reading == upper.reading
    )
    print("its prototype of a 3:", upper.aggregates[3].prototypes["3_1"])


if __name__ == "__main__":
    main()
