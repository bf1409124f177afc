"""Mesh files between `interpolate`, trimesh and meshio: what it writes they read, what they write it reads.

    pip install trimesh meshio numpy
    python experiments/python/check_files.py target/release/interpolate

A mesh of triangles and one of triangles, quads and a pentagon go through every format, with normals and without. Positions
must be equal by the last bit, in text as in binary, and faces by their vertices; trimesh, which has triangles only, must see
those that it makes of the polygons. STL and glTF, which `interpolate` reads and does not write, come from the libraries; OFF
with normals, colours and texture coordinates from here, and both sides must see one mesh. Where a library has no reader of its
own for a kind of file, that is listed in `LACKS` and held to: a line there that is no longer true fails too. Exit status 1 if
anything differs.
"""

import contextlib
import pathlib
import subprocess
import sys
import tempfile

import meshio
import numpy as np
import trimesh

# Kinds of files that a library does not take: meshio's reader of OFF knows the word OFF and triangles alone; trimesh takes faces
# of different sizes from OBJ and from text PLY (--ascii), not from OFF and binary PLY.
LACKS = {
    ("meshio", "noff", "triangles"),
    ("meshio", "off", "polygons"),
    ("meshio", "noff", "polygons"),
    ("trimesh", "off", "polygons"),
    ("trimesh", "noff", "polygons"),
    ("trimesh", "ply", "polygons"),
    ("trimesh", "ply-normals", "polygons"),
    ("meshio", "COFF", "triangles"),
    ("meshio", "CNOFF", "triangles"),
    ("meshio", "NCOFF", "triangles"),
    ("meshio", "STOFF", "triangles"),
    ("meshio", "STCNOFF", "triangles"),
}
# What follows the position of a vertex, by the header: numbers that tell normals, which have length 1, from colours.
VARIANTS = {
    "COFF": "255 0 128 255",
    "CNOFF": "0 0 1 255 0 128 255",
    "NCOFF": "255 0 128 255 0 0 1",
    "STOFF": "0.25 0.5",
    "STCNOFF": "0 0 1 255 0 128 255 0.25 0.5",
}

TRIANGLES = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
POLYGONS = (
    "".join(f"v {x} {y} {z}\n" for x, y, z in [(0, 0, 0), (2, 0, 0), (3, 1, 0), (1, 2, 0.1), (-1, 1, 0), (1, 1, 2)])
    + "f 5 4 3 2 1\nf 1 2 6\nf 2 3 6\nf 3 4 6\nf 4 5 6\nf 5 1 6\n"
)
QUADS = "v 4 0 0\nv 5 0 0\nv 5 1 0\nv 4 1 1\nf 7 8 9 10\n"


def read_obj(path):
    """Positions and faces of an OBJ, by the simplest means."""
    lines = [line.split() for line in path.read_text().splitlines()]
    points = np.array([[float(x) for x in words[1:4]] for words in lines if words[:1] == ["v"]])
    faces = [[int(word.split("/")[0]) - 1 for word in words[1:]] for words in lines if words[:1] == ["f"]]
    return points, faces


def canonical(faces):
    """Faces in any order, each from its least vertex on."""
    turned = []
    for face in faces:
        face = [int(v) for v in face]
        start = face.index(min(face))
        turned.append(tuple(face[start:] + face[:start]))
    return sorted(turned)


def triangulated(faces):
    """The triangles that a fan makes of polygons."""
    return sorted(tuple(sorted((f[0], f[k], f[k + 1]))) for f in faces for k in range(1, len(f) - 1))


def write_off(path, header, points, faces):
    rows = [" ".join(map(repr, map(float, p))) + " " + VARIANTS[header] for p in points]
    rows += [" ".join(map(str, [len(f), *f])) for f in faces]
    path.write_text(f"{header}\n{len(points)} {len(faces)} 0\n" + "\n".join(rows) + "\n")


def write_gltf(shape, path):
    """The JSON, and the buffers beside it."""
    for name, content in trimesh.exchange.gltf.export_gltf(trimesh.Scene(shape)).items():
        (path if name.endswith(".gltf") else path.parent / name).write_bytes(content)


def corners(points, faces):
    """The positions of all corners, face by face: the same whatever the numbers of the vertices are."""
    return np.array([points[v] for face in faces for v in face])


def seen_by_trimesh(path):
    mesh = trimesh.load(path, process=False, maintain_order=True)
    return np.asarray(mesh.vertices), [list(face) for face in mesh.faces]


def seen_by_meshio(path):
    mesh = meshio.read(path)
    return np.asarray(mesh.points), [list(face) for block in mesh.cells for face in block.data if block.type != "vertex"]


def main(program):
    failures = 0
    checks = 0

    def interpolate(*arguments):
        done = subprocess.run([program, *map(str, arguments), "--quiet"], capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(done.stderr.strip())

    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for kind, text in (("triangles", TRIANGLES), ("polygons", POLYGONS + QUADS)):
            given = folder / "given.obj"
            given.write_text(text)
            wanted = folder / "wanted.obj"
            interpolate(given, "-o", wanted, "--scheme", "catmull-clark")
            points, faces = read_obj(wanted)
            for name, flags in {
                "obj": [],
                "off": [],
                "noff": ["--write-normals"],
                "ply": [],
                "ply-normals": ["--write-normals"],
                "ply-text": ["--ascii"],
            }.items():
                cage = folder / f"cage.{name.replace('noff', 'off')[:3]}"
                interpolate(given, "-o", cage, "--scheme", "catmull-clark", *flags)
                for library, see in (("trimesh", seen_by_trimesh), ("meshio", seen_by_meshio)):
                    checks += 1
                    lacks = (library, name, kind) in LACKS
                    try:
                        # meshio prints before it ends the process.
                        with contextlib.redirect_stdout(None), contextlib.redirect_stderr(None):
                            there, polygons = see(cage)
                        same = np.array_equal(there, points) and (
                            canonical(polygons) == canonical(faces)
                            or library == "trimesh" and len(polygons) == len(triangulated(faces))
                        )
                        what = "" if same else f"{len(there)} vertices, {len(polygons)} faces, or others"
                    except BaseException as error:  # noqa: BLE001: meshio ends the process on what it cannot read.
                        what = f"{type(error).__name__} {error}"
                    if lacks != bool(what):
                        failures += 1
                        print(f"{library} reads {name} of {kind}: {what or 'and is said not to'}")

            if kind == "triangles":
                for header in VARIANTS:
                    path, back = folder / "variant.off", folder / "back.obj"
                    write_off(path, header, points, faces)
                    interpolate(path, "-o", back, "--scheme", "catmull-clark")
                    again = folder / "again.obj"
                    interpolate(wanted, "-o", again, "--scheme", "catmull-clark")
                    checks += 1
                    if back.read_text().split("v ", 1)[1] != again.read_text().split("v ", 1)[1]:
                        failures += 1
                        print(f"interpolate sees another mesh in {header}")
                    for library, see in (("trimesh", seen_by_trimesh), ("meshio", seen_by_meshio)):
                        checks += 1
                        try:
                            with contextlib.redirect_stdout(None), contextlib.redirect_stderr(None):
                                there, polygons = see(path)
                            what = "" if np.array_equal(there, points) and canonical(polygons) == canonical(faces) else "another mesh"
                        except BaseException as error:  # noqa: BLE001: meshio ends the process on what it cannot read.
                            what = f"{type(error).__name__} {error}"
                        if ((library, header, kind) in LACKS) != bool(what):
                            failures += 1
                            print(f"{library} reads {header}: {what or 'and is said not to'}")

            # And back: what they write of these meshes.
            cells = [(("triangle", "quad", "polygon")[min(len(f), 5) - 3], [f]) for f in faces]
            writers = {}
            if kind == "triangles":
                shape = trimesh.Trimesh(points, faces, process=False)
                for ending, options in (("off", {}), ("obj", {"digits": 17}), ("ply", {}), ("ply", {"encoding": "ascii"})):
                    if ending == "off":
                        options = {"digits": 17}
                    writers[f"trimesh {ending} {options}"] = (ending, lambda p, o=options: shape.export(p, **o))
                for name in ("stl", "stl_ascii", "glb"):
                    ending = name[:3]
                    writers[f"trimesh {name}"] = (ending, lambda p, n=name: shape.export(p, file_type=n))
                writers["trimesh gltf"] = ("gltf", lambda p: write_gltf(shape, p))
            for ending, options in (
                ("off", {}),
                ("obj", {}),
                ("ply", {"binary": True}),
                ("ply", {"binary": False}),
                ("stl", {"binary": True}),
                ("stl", {"binary": False}),
            ):
                if ending in ("off", "stl") and kind == "polygons":
                    continue
                mesh = meshio.Mesh(points, cells)
                writers[f"meshio {ending} {options}"] = (ending, lambda p, m=mesh, o=options: meshio.write(p, m, **o))
            for name, (ending, write) in writers.items():
                checks += 1
                path, back = folder / f"theirs.{ending}", folder / "back.obj"
                try:
                    write(path)
                    interpolate(path, "-o", back, "--scheme", "catmull-clark")
                    again = folder / "again.obj"
                    interpolate(wanted, "-o", again, "--scheme", "catmull-clark")
                    (there, polygons), (expected, _) = read_obj(back), read_obj(again)
                    scale = np.abs(expected).max()
                    # Whose vertices are numbered by the first corner at each.
                    renumbered = ending in ("stl", "glb", "gltf")
                    same = renumbered or canonical(polygons) == canonical(faces)
                    if not same or len(there) != len(points) or len(polygons) != len(faces):
                        raise RuntimeError("other points or faces")
                    if np.abs(corners(there, polygons) - corners(expected, faces)).max() > 1e-6 * scale:
                        raise RuntimeError("other positions")
                except Exception as error:  # noqa: BLE001: one line for each failure.
                    failures += 1
                    print(f"interpolate reads {name} of {kind}: {error}")
    print(f"files between interpolate, trimesh {trimesh.__version__} and meshio {meshio.__version__}: {checks} checks, {failures} failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(str(pathlib.Path(sys.argv[1]).resolve())))
