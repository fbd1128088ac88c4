"""Checkouts, environments and installed wheels, as others would have them."""

import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent
FOLDERS = sorted(link.name for link in (ROOT / "farside").iterdir() if link.is_symlink())
LITTER = (".git", ".venv", ".*_cache", ".hypothesis", "__pycache__", "runs", "build", "dist")


def checkout(folder: Path, *, links: bool = True) -> Path:
    """A copy of this checkout, as clean as a clone; without `links`, as git then writes it."""
    shutil.copytree(ROOT, folder, symlinks=True, ignore=shutil.ignore_patterns(*LITTER))
    if not links:
        for name in FOLDERS:
            link = folder / "farside" / name
            target = link.readlink()
            link.unlink()
            link.write_text(str(target))
    return folder


def build(source: Path, folder: Path, *targets: str) -> None:
    """Build into `folder`; by default an sdist, and from it a wheel."""
    command: list[str | Path] = [
        sys.executable,
        "-m",
        "build",
        "--no-isolation",
        "--outdir",
        folder,
        source,
    ]
    subprocess.run([*command, *targets], check=True)  # noqa: S603


def environment(folder: Path) -> Path:
    """The Python of a fresh environment that sees all packages of this one, but not Farside."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True)  # noqa: S603
    python = folder / "bin" / "python"
    # What an editable install put on the path is named in a .pth of its own, which is not read.
    site = sysconfig.get_path("purelib", vars={"base": str(folder)})
    (Path(site) / "packages.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return python


def install(python: Path, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """`pip install`, from nothing but what is here."""
    command: list[str | Path] = [sys.executable, "-m", "pip", "--python", python, "install"]
    return subprocess.run(  # noqa: S603
        [*command, "--no-deps", "--no-index", "--no-build-isolation", *arguments],
        capture_output=True,
        text=True,
        check=False,
    )


def members(wheel: Path) -> list[str]:
    """The files in a wheel, but for those that tell of the wheel itself."""
    with zipfile.ZipFile(wheel) as archive:
        return sorted(name for name in archive.namelist() if ".dist-info/" not in name)
