"""Build wheel and sdist, check both, and use the wheel where nothing but the wheel is.

``make dist``. PYTHONS names the interpreters to try, separated by spaces; without it, the one
that runs this. It works on any system, without a shell.
"""

import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).parent.parent
DIST = ROOT / "dist"
PYTHONS = "PYTHONS"
"""Environment variable: the interpreters to try."""

SCENE = "12-flat-lambertian"
"""A scene of the package that is traced in a moment."""
ROUGH = "--gamma 2 --sigma 0.3 --theta 60 --cells 64 --realisations 2 --paths 2000"
"""A surface that both engines trace in a moment."""

_SCENE_PATH = (
    "import microsurf, pathlib; root = pathlib.Path(microsurf.__file__).parent; "
    f"print(root / 'scene' / 'builtin' / '{SCENE}.toml')"
)
_HAS_EMBREE = "import importlib.util; print(importlib.util.find_spec('embreex') is not None)"


def main() -> None:
    """Build, check, install and use; the first command that fails ends it."""
    shutil.rmtree(DIST, ignore_errors=True)
    run(sys.executable, "-m", "build", "--outdir", DIST)
    (wheel,), (sdist,) = DIST.glob("*.whl"), DIST.glob("*.tar.gz")
    run(sys.executable, "-m", "twine", "check", "--strict", wheel, sdist)
    report(f"{wheel.name} {wheel.stat().st_size} bytes, {sdist.name} {sdist.stat().st_size} bytes")
    with zipfile.ZipFile(wheel) as archive:
        refuse("wheel", missing(archive.namelist()))
        (described,) = (n for n in archive.namelist() if n.endswith(".dist-info/METADATA"))
        refuse("long description", relative_links(archive.read(described).decode()))
    with tarfile.open(sdist) as archive:
        refuse("sdist", missing(name.partition("/")[2] for name in archive.getnames()))
    for python in os.environ.get(PYTHONS, sys.executable).split():
        report(f"{python}: {use(python, wheel)}")


def missing(names: Iterable[str]) -> list[str]:
    """Files of the package, code and data alike, that an archive lacks."""
    own = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "microsurf").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    return sorted(own - set(names))


def relative_links(text: str) -> list[str]:
    """Links of a Markdown text that lead nowhere outside of the repository."""
    return re.findall(r"\]\((?!https://|#)[^)]*\)", text)


def refuse(what: str, faults: list[str]) -> None:
    """End with the faults, if there are any."""
    if faults:
        raise SystemExit(f"{what}: {', '.join(faults)}")


def use(python: str, wheel: Path) -> str:
    """Install a wheel in an empty environment, validate a scene and trace a rough surface."""
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        run(python, "-m", "venv", place / "clean", cwd=place)
        scripts = place / "clean" / ("Scripts" if os.name == "nt" else "bin")
        own = scripts / ("python.exe" if os.name == "nt" else "python")
        constraints = ROOT / "constraints.txt"
        run(own, "-m", "pip", "install", "--quiet", "--constraint", constraints, wheel, cwd=place)
        run(own, "-m", "pip", "check", cwd=place)
        scene = run(own, "-c", _SCENE_PATH, cwd=place)
        microsurf = scripts / ("microsurf.exe" if os.name == "nt" else "microsurf")
        run(microsurf, "validate", scene, "--no-refine", "--out", place / "report", cwd=place)
        for page in ("report.html", "report.json", "report.md", "junit.xml"):
            refuse(page, [] if (place / "report" / page).stat().st_size else ["empty"])
        engines = ["exact"]
        if run(own, "-c", _HAS_EMBREE, cwd=place) == "True":
            engines.append("embree")
        for engine in engines:
            run(microsurf, "measure", *ROUGH.split(), "--engine", engine, cwd=place)
        return f"{run(own, '--version')}, {SCENE} validated, traced by {' and '.join(engines)}"


def run(*command: str | Path, cwd: Path = ROOT) -> str:
    """Run a command to its end, without anything of this checkout on Python's path."""
    hidden = ("PYTHONPATH", "PYTHONHOME")
    done = subprocess.run(  # noqa: S603 - our own words
        [str(word) for word in command],
        cwd=cwd, check=True, stdout=subprocess.PIPE, text=True, encoding="utf-8",
        env={k: v for k, v in os.environ.items() if k not in hidden},
    )  # fmt: skip
    return done.stdout.strip()


def report(line: str) -> None:
    """Print a line at once."""
    print(line, flush=True)  # noqa: T201 - a script


if __name__ == "__main__":
    main()
