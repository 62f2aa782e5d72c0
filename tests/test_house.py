"""What holds for the whole package: public names, docstrings, lazy imports, the exception tree."""

import importlib
import inspect
import pkgutil
import subprocess
import sys

import pytest
from numpydoc.validate import validate

import evifuse
from evifuse import errors

MODULES = sorted(
    name
    for _, name, _ in pkgutil.walk_packages(evifuse.__path__, "evifuse.")
    if not name.rsplit(".", 1)[1].startswith("_")
)
CHECKS = {
    "GL05", "GL06", "GL07", "GL08", "GL09", "GL10", "SS02", "SS03", "SS04", "PR01", "PR02", "PR03", "PR04",
    "PR06", "PR07", "PR08", "RT01", "RT03", "YD01",
}  # fmt: skip


def _public(module_name: str) -> list[tuple[str, object]]:
    module = importlib.import_module(module_name)
    found: list[tuple[str, object]] = []
    for name in getattr(module, "__all__", []):
        value = getattr(module, name)
        if getattr(value, "__module__", None) != module_name or not callable(value):
            continue
        found.append((name, value))
        if inspect.isclass(value):
            found += [
                (f"{name}.{key}", member)
                for key, member in vars(value).items()
                if not key.startswith("_") and (inspect.isfunction(member) or isinstance(member, property))
            ]
    return found


@pytest.mark.parametrize("module", MODULES)
def test_public_docstrings_are_complete(module: str) -> None:
    faults = []
    for name, value in _public(module):
        for code, text in validate(f"{module}.{name}")["errors"]:
            if isinstance(value, property) and code in ("RT01", "PR01"):
                continue
            if getattr(value, "_is_protocol", False) and "'*args'" in text:
                continue  # the constructor that typing gives a protocol
            if code in CHECKS:
                faults.append(f"{module}.{name}: {code} {text}")
    assert not faults, "\n".join(faults)


@pytest.mark.parametrize("module", MODULES)
def test_public_names_exist_and_are_sorted_into_all(module: str) -> None:
    loaded = importlib.import_module(module)
    names = getattr(loaded, "__all__", [])
    assert len(names) == len(set(names))
    assert all(hasattr(loaded, name) for name in names)


def test_exported_members() -> None:
    for name in evifuse.__all__:
        assert getattr(evifuse, name) is not None
    assert set(evifuse.__all__) <= set(dir(evifuse))
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = evifuse.nothing  # type: ignore[attr-defined]


def test_every_error_is_in_the_tree_that_is_drawn() -> None:
    assert errors.__doc__ is not None
    for name in errors.__all__:
        assert name in errors.__doc__
        assert issubclass(getattr(errors, name), errors.EvifuseError)


@pytest.mark.parametrize(
    "statement",
    [
        "import evifuse",
        "import evifuse.belief",
        "import evifuse.fusion, evifuse.vision, evifuse.touch, evifuse.recordings, evifuse.simulation",
        "import evifuse.app.main",
    ],
)
def test_heavy_imports_are_lazy(statement: str) -> None:
    heavy = "{'cv2', 'mujoco', 'scipy', 'matplotlib', 'rosbags', 'mcap', 'numba', 'pandas', 'pyarrow'}"
    code = f"import sys; {statement}; print(sorted({heavy} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_importing_the_package_alone_does_not_import_numpy() -> None:
    code = "import sys, evifuse; print('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
