"""Packs the add-on for Blender's *Install from Disk*: `python blender/pack.py [FOLDER]` writes limitlab_addon.zip."""

import pathlib
import sys
import zipfile

HERE = pathlib.Path(__file__).resolve().parent


def pack(folder):
    """Writes the archive into the folder; returns its path. The same bytes from the same file."""
    archive = folder / "limitlab_addon.zip"
    with zipfile.ZipFile(archive, "w") as out:
        entry = zipfile.ZipInfo("limitlab_addon.py")
        entry.compress_type = zipfile.ZIP_DEFLATED
        entry.external_attr = 0o644 << 16
        out.writestr(entry, (HERE / "limitlab_addon.py").read_bytes())
    return archive


if __name__ == "__main__":
    print(pack(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")))
