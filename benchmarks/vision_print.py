"""The figures of `vision.py` as tables."""

from typing import Any

from vision_training import OURS, THEIRS


def _share(row: dict[str, Any] | None, digits: int = 3) -> str:
    """A value with its interval."""
    if row is None or row.get("mean", 0.0) is None:
        return "-"
    value = next(row[k] for k in ("accuracy", "auroc", "mean", "f", "recall") if k in row)
    text = f"{value:.{digits}f}"
    if row.get("interval") is None:
        return text
    low, high = row["interval"]
    return f"{text} ({low:.{digits}f} - {high:.{digits}f})"


def print_header() -> None:
    print("accuracy of the first object, 95 % interval of Wilson; by class (R, T, E); nothing seen")
    print(f"{'':22}{'right':24}{'n':>5}{'ms':>7}  {'R / T / E':24}{'nothing':>8}{'ECE (%)':>9}", flush=True)


def print_sensor(name: str, row: dict[str, Any]) -> None:
    shares = " / ".join(f"{v:.3f}" for v in row["per_class"].values())
    print(
        f"{name:22}{_share(row):24}{row['count']:5}{row['ms_per_image']:7.1f}  {shares:24}"
        f"{row['nothing_seen']:8}{100 * row['calibration']['error']:9.1f}",
        flush=True,
    )


def print_rivals(rivals: dict[str, dict[str, Any]]) -> None:
    for name, row in rivals.items():
        print(f"    {name:34}{_share(row)}", flush=True)


def print_overall(name: str, row: dict[str, Any]) -> None:
    print(f"expected calibration error, {name}: {100 * row['error']:.1f} % of {row['count']} (10 equal bins)")


def print_strangers(sensor: dict[str, dict[str, Any]]) -> None:
    print("\nstrangers told from the three shapes: AUROC, 95 % interval of the bootstrap (1000 draws)")
    print(f"{'':22}{'mass on the frame':24}{'conflict (dissonance)':24}{'1 - pignistic':24}strangers")
    for name, row in sensor.items():
        some = row["strangers"]
        count = 0 if some["frame"] is None else some["frame"]["other"]
        cells = "".join(f"{_share(some[k], 2):24}" for k in ("frame", "conflict", "pignistic"))
        print(f"{name:22}{cells}{count}")


def print_learned(source: str, learned: dict[str, dict[str, Any]]) -> None:
    print(f"\nlearned from clean {source}, examples of each class: mean over draws, 95 % interval (Student)")
    print("(prototypes on the sensor's evidence; its own weights are learned from all of the other half)")
    print(f"{'':22}{OURS:26}{THEIRS:26}{'difference, paired':28}draws")
    for count, conditions in learned.items():
        for condition, row in conditions.items():
            cells = _share(row[OURS]), _share(row[THEIRS]), _share(row["difference"])
            print(f"{count + ', ' + condition:22}{cells[0]:26}{cells[1]:26}{cells[2]:28}{row['draws']}")


def print_scenes(row: dict[str, Any]) -> None:
    print(f"\nroad scenes: signs of 36 px and more found with their shape: {_share(row)}, of {row['count']}")
    print(f"with any shape: {row['found']:.3f}; {row['objects_per_photo']:.1f} objects each, ", end="")
    print(f"{row['ms_per_image']:.0f} ms")
    tenths = " / ".join(f"{v:.2f}" for v in row["best_overlap"])
    print(f"best overlap with a sign, 10 / 25 / 50 / 75 / 90 % of the signs: {tenths}")
    print(f"{'least belief':>14}{'named':>8}{'precision':>11}{'recall':>8}   (what is no sign is wrong)")
    for r in row["curve"]:
        precision = "-" if r["precision"] is None else f"{r['precision']:.3f}"
        print(f"{r['belief']:14.1f}{r['named']:8}{precision:>11}{r['recall']:8.3f}")


def print_ellipses(figures: dict[str, dict[str, Any]]) -> None:
    print("\nellipses, F at an overlap above 0.8, 95 % interval of the bootstrap; precision, recall")
    for name, row in figures.items():
        for finder in (k for k in row if isinstance(row[k], dict)):
            one = row[finder]
            print(
                f"{name:12}{finder:14}{_share(one):24}{one['precision']:.3f}, {one['recall']:.3f}"
                f"  ({row['true']} in {row['pictures']} pictures)"
            )
