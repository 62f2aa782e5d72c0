"""The command line: ``evifuse demo``, ``fuse``, ``shape``, ``touch`` and the others, one function each.

Only what parses the command line is imported here; each command imports what it needs.
"""

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, CycloptsError, Group, Parameter

from evifuse._version import __version__
from evifuse.errors import EvifuseError, UsageError

__all__ = ["app", "main"]

app = App(
    name="evifuse",
    version=__version__,
    help_format="plaintext",  # markdown would double the time of --help
    suppress_keyboard_interrupt=False,  # main says what was stopped
    help="Say what a surface is from a picture and a rolled finger, how sure that is, and why.",
)
OUTPUT = Group("Output")
Json = Annotated[
    bool, Parameter(name="--json", negative="", group=OUTPUT, help="Print JSON instead of tables.")
]
Draw = Annotated[
    Path | None,
    Parameter(
        name="--draw",
        group=OUTPUT,
        help="Also draw what was seen and felt into this PNG (for many pictures: folder).",
    ),
]
ShapeKnowledge = Annotated[
    str,
    Parameter(help="Classes of shapes: shape (ours), chapter-shape (table 1), or a YAML file of your own."),
]
CurvatureKnowledge = Annotated[
    str,
    Parameter(
        help="Classes of curvature: curvature (ours), chapter-curvature (table 4), or your own YAML file."
    ),
]
Fingertip = Annotated[
    str | None,
    Parameter(help="Layout instead of the recording's own: sphere, paxini:MODEL, or a CSV or JSON file."),
]
Topics = Annotated[
    str | None,
    Parameter(help="Topics of a bag that are not the documented ones: pose=/a,pressures=/b,joint=/c:name."),
]
Unit = Annotated[
    str | None, Parameter(help="Unit of the pressures instead of the recording's own: Pa, kPa, bar, ...")
]
Surface = Literal[
    "plane", "cylinder", "sphere", "bowl", "trough", "saddle", "hole", "ellipsoid", "torus", "edge", "step",
    "corner", "slot",
]  # fmt: skip


@app.command
def demo(
    surface: Surface = "cylinder",
    *,
    out: Annotated[
        Path, Parameter(name=["--out", "-o"], help="Folder for the scene and the picture.")
    ] = Path("out"),
    seed: int = 0,
    json: Json = False,
) -> None:
    """Simulate one scene, fuse it, print the tables and draw the picture.

    Parameters
    ----------
    surface
        What the finger rolls over.
    seed
        Seed of the sensor noise.
    """
    from evifuse.app.commands import run_demo

    run_demo(surface, out, seed, json)


@app.command
def fuse(
    scene: Path | None = None,
    /,
    *,
    image: Path | None = None,
    touch: Path | None = None,
    box: Annotated[
        str | None,
        Parameter(help="Pixel box x,y,w,h of the object that was touched.", allow_leading_hyphen=True),
    ] = None,
    shape_knowledge: ShapeKnowledge = "shape",
    fingertip: Fingertip = None,
    topics: Topics = None,
    unit: Unit = None,
    curvature_knowledge: CurvatureKnowledge = "curvature",
    json: Json = False,
    draw: Draw = None,
) -> None:
    """Fuse a picture and a rolled finger: one SCENE.mcap, or --image and --touch.

    Parameters
    ----------
    scene
        MCAP file with both senses.
    image
        Picture, or an MCAP file that holds one.
    touch
        Touch recording: MCAP, ROS 2 bag, CSV, NPZ or Parquet.
    """
    from evifuse.app.commands import run_fuse
    from evifuse.app.given import given_by

    given = given_by(fingertip, topics, unit)
    run_fuse(scene, image, touch, parse_box(box), given, shape_knowledge, curvature_knowledge, json, draw)


@app.command
def shape(
    *images: str,
    camera: Annotated[
        int | None, Parameter(help="Look through the camera of this number instead; Ctrl-C ends it.")
    ] = None,
    every: Annotated[int, Parameter(help="Take every so many frames of a video or camera.")] = 1,
    frames: Annotated[
        int | None, Parameter(help="Take at most so many frames of each video or of the camera.")
    ] = None,
    intrinsics: Annotated[
        str | None,
        Parameter(help="Camera fx,fy,cx,cy in px, or a ROS calibration file; an MCAP file brings its own."),
    ] = None,
    plane: Annotated[
        str | None,
        Parameter(
            help="Plane nx,ny,nz,d that objects lie on, camera frame, d in metres: adds metres to pixels.",
            allow_leading_hyphen=True,
        ),
    ] = None,
    depth: Annotated[
        str | None,
        Parameter(help="Instead of --plane: depth in metres, or a depth picture (PNG, TIFF, NPY)."),
    ] = None,
    shape_knowledge: ShapeKnowledge = "shape",
    primitives: Annotated[
        str | None,
        Parameter(help="Primitives of your own beside the built-in ones: my_module:NAME or my_file.py:NAME."),
    ] = None,
    json: Json = False,
    draw: Draw = None,
) -> None:
    """See the shapes in pictures, videos, or through a camera.

    Parameters
    ----------
    images
        Pictures, videos, MCAP files with a picture, folders of them, or patterns such as 'photos/*.jpg'.
    """
    from evifuse.app.shapes import run_shape

    run_shape(
        images, camera, every, frames, intrinsics, plane, depth, shape_knowledge, primitives, json, draw
    )


@app.command
def touch(
    *recordings: Annotated[str, Parameter(allow_leading_hyphen=True)],
    fingertip: Fingertip = None,
    topics: Topics = None,
    unit: Unit = None,
    live: Annotated[
        bool, Parameter(negative="", help="Read samples from standard input as they come, as JSON lines.")
    ] = False,
    every: Annotated[
        int | None, Parameter(help="Live: a line after every so many samples, with the curvature so far.")
    ] = None,
    curvature_knowledge: CurvatureKnowledge = "curvature",
    belief: Annotated[
        Literal["resolved", "chapter"],
        Parameter(help="Belief of a local curvature: resolved (ours) or chapter (4.1.4, zero on a plane)."),
    ] = "resolved",
    json: Json = False,
    draw: Draw = None,
) -> None:
    """Feel the curvature of a surface from a rolled finger.

    Parameters
    ----------
    recordings
        Touch recordings: MCAP, ROS 2 bags, CSV, NPZ, Parquet, folders of them, patterns, or - for live.
    """
    from evifuse.app.given import given_by
    from evifuse.app.touches import run_touch

    run_touch(
        recordings, given_by(fingertip, topics, unit), live, every, curvature_knowledge, belief, json, draw
    )


@app.command
def check(
    *recordings: str,
    fingertip: Fingertip = None,
    topics: Topics = None,
    unit: Unit = None,
    json: Json = False,
) -> None:
    """Say what a touch recording lacks, part by part; exit code 2 if an estimate would be refused.

    Parameters
    ----------
    recordings
        Touch recordings: MCAP, ROS 2 bags, CSV, NPZ, Parquet, folders of them, or patterns.
    """
    from evifuse.app.check import run_check
    from evifuse.app.given import given_by

    run_check(recordings, given_by(fingertip, topics, unit), json)


@app.command
def simulate(
    surface: str | None = None,
    /,
    *,
    out: Annotated[
        Path | None, Parameter(name=["--out", "-o"], help="MCAP file to write, or folder for --random.")
    ] = None,
    radius: Annotated[float | None, Parameter(help="Radius of the surface, metres.")] = None,
    size: Annotated[
        tuple[str, ...], Parameter(help="Other dimensions of it, such as length_m=0.05; can be repeated.")
    ] = (),
    fingertip: Annotated[
        str | None,
        Parameter(help="Layout of the taxels: sphere, paxini:MODEL, or a CSV or JSON file."),
    ] = None,
    noise: Annotated[
        Literal["none", "modest", "strong"] | None,
        Parameter(help="Noise on pressures and poses: none without it; for --random any by chance."),
    ] = None,
    random: Annotated[
        int | None, Parameter(help="Write so many labelled random recordings into a folder instead.")
    ] = None,
    mesh: Annotated[
        tuple[str, ...],
        Parameter(help="For --random: roll over these meshes (files, folders), or over 'random' ones."),
    ] = (),
    list_: Annotated[
        bool, Parameter(name="--list", negative="", help="Print the catalogue of surfaces.")
    ] = False,
    seed: int = 0,
    json: Json = False,
) -> None:
    """Roll a fingertip over a surface in MuJoCo and write picture and touch as MCAP.

    Parameters
    ----------
    surface
        What the finger rolls over: a name of the catalogue, or a watertight mesh (STL, OBJ, PLY, metres).
    seed
        Seed of the noise, of sites on a mesh, and of a random data set.
    """
    from evifuse.app.simulations import run_list, run_random, run_simulate

    if list_:
        run_list(json)
    elif out is None:
        raise UsageError("nothing to write to: give --out, or --list for the catalogue")
    elif random is not None:
        if surface is not None or radius is not None or size:
            raise UsageError("--random draws the surfaces itself: leave SURFACE, --radius and --size out")
        run_random(random, seed, out, fingertip, noise, mesh, json)
    elif mesh:
        raise UsageError(f"--mesh {mesh[0]} is for --random: for one recording give the mesh as SURFACE")
    elif surface is None:
        raise UsageError("nothing to simulate: give a surface or a mesh, --random N, or --list")
    else:
        run_simulate(surface, out, seed, radius, size, fingertip, noise or "none", json)


@app.command
def classify(
    masses: Path,
    /,
    *,
    knowledge: Annotated[
        str, Parameter(help="Classes: a built-in knowledge base by name, or a YAML file of your own.")
    ],
    out: Annotated[Path, Parameter(name=["--out", "-o"], help="Parquet file to write.")],
    reading: Annotated[
        str | None,
        Parameter(help="How the formulas are read: sound, printed or working, instead of the KB's own."),
    ] = None,
    scheduler: Annotated[
        str | None,
        Parameter(help="Where to compute: local, local:N processes, or tcp://host:port of a Dask scheduler."),
    ] = None,
    rows_per_part: Annotated[
        int, Parameter(help="Rows that are computed together; a kill costs at most so many per worker.")
    ] = 1 << 20,
    json: Json = False,
) -> None:
    """Classify every row of a Parquet file of masses; after a kill the same command goes on.

    Parameters
    ----------
    masses
        What evifuse.belief.to_parquet writes: a row for each case.
    """
    from evifuse.app.stream import run_classify

    run_classify(masses, out, knowledge, reading, scheduler, rows_per_part, json)


@app.command
def reproduce(*, json: Json = False) -> None:
    """Print every published figure of the chapter beside the computed one."""
    from evifuse.app.commands import run_reproduce

    run_reproduce(json)


@app.command
def train(
    evidence: Path,
    /,
    *,
    out: Annotated[Path, Parameter(name=["--out", "-o"], help="YAML file to write.")],
    labels: Annotated[
        Path | None,
        Parameter(help="Text file with a label on each line; a Parquet file may have a column `label`."),
    ] = None,
    reading: Annotated[
        str | None, Parameter(help="How appendix A is read; chosen on held-out cases without it.")
    ] = None,
    max_prototypes: Annotated[int, Parameter(help="At most so many prototypes for each class.")] = 3,
    seed: int = 0,
    json: Json = False,
) -> None:
    """Learn the prototypes of classes from labelled evidence, and write them as a knowledge base.

    Parameters
    ----------
    evidence
        Mass functions as Parquet, CSV or JSON.
    seed
        Seed of the folds and of the clusters.
    """
    from evifuse.app.training import run_train

    run_train(evidence, out, labels, reading, max_prototypes, seed, json)


@app.command
def readings(
    *,
    knowledge: Annotated[
        str | None,
        Parameter(help="Classes: a built-in name or a YAML file of your own; all built-in ones without it."),
    ] = None,
    evidence: Annotated[
        Path | None,
        Parameter(help="Parquet file of mass functions with a column `label`: which reading suits it?"),
    ] = None,
    sweep: Annotated[
        bool, Parameter(negative="", help="Also try thousands of combinations of choices.")
    ] = False,
    seed: int = 0,
    json: Json = False,
) -> None:
    """Compare readings of appendix A on the published figures, or on labelled evidence.

    Parameters
    ----------
    seed
        Seed of the split of the evidence: one half to choose on, the other to judge on.
    """
    from evifuse.app.readings import run_readings

    run_readings(knowledge, evidence, sweep, seed, json)


@app.command
def knowledge(name: Literal["shape", "curvature", "chapter-shape", "chapter-curvature"], /) -> None:
    """Print a built-in knowledge base as YAML, to copy and change.

    Parameters
    ----------
    name
        Which one.
    """
    from evifuse.knowledge import built_in_text

    sys.stdout.write(built_in_text(name))


def parse_box(text: str | None) -> tuple[float, float, float, float] | None:
    """Pixel box from its text on the command line.

    Parameters
    ----------
    text : str or None
        ``x,y,w,h`` in px.

    Returns
    -------
    tuple of float or None
        The four numbers.

    Raises
    ------
    UsageError
        If it is not four numbers.
    """
    if text is None:
        return None
    try:
        x, y, w, h = (float(part) for part in text.split(","))
    except ValueError:
        raise UsageError(f"--box needs four numbers x,y,w,h in px, not {text!r}") from None
    return x, y, w, h


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 done, 2 for the user's mistake, 1 for ours.

    Parameters
    ----------
    arguments : sequence of str, optional
        Instead of the process's own.
    """
    sys.exit(_run(arguments))


def _run(arguments: Sequence[str] | None) -> int:
    try:
        app(arguments, exit_on_error=False, print_error=False)
        sys.stdout.flush()
    except (EvifuseError, CycloptsError) as e:
        return _complain(str(e), 2)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as e:
        where = f"{e.filename}: " if e.filename else ""
        return _complain(f"{where}{e.strerror or e}", 2)
    except KeyboardInterrupt as e:
        return _complain(str(e) or "stopped", 130)
    except MemoryError:
        return _complain("not enough memory for this input", 2)
    except Exception as e:  # the last door: a user gets a line, not a traceback
        if isinstance(e.__cause__ or e.__context__, KeyboardInterrupt):  # within compiled code
            return _complain("stopped", 130)
        if os.environ.get("EVIFUSE_DEBUG"):
            raise
        return _complain(f"internal error: {type(e).__name__}: {e} (EVIFUSE_DEBUG=1 shows where)", 1)
    return 0


def _complain(message: str, code: int) -> int:
    line = " ".join(message.split())
    print(f"evifuse: {line}", file=sys.stderr)
    return code
