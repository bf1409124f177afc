"""The add-on in Blender: how far the evaluated limit surface is from where the vertices were.

    pip install bpy==5.0.1        # an environment of its own, Python 3.11
    python blender/check_addon.py target/release/interpolate [FOLDER]

Installs the add-on from the archive that `pack.py` makes, runs it on Suzanne, a creased torus, an open grid under both rules
of the boundary, some vertices of a sphere, a mesh with shape keys, and on meshes that it has to refuse. Distances are relative
to the diagonal of the given points, at the limit surface of quality 8. Exit status 1 where one is above 2e-6, where texture
coordinates or materials changed, or where a refusal selects something else than the defect. What Blender evaluated is written
to FOLDER as .obj files. Where the package `limitlab` is installed beside bpy, it computes; else the program does.
"""

import pathlib
import sys
import tempfile

import bpy
import numpy as np
import pack

ALLOWED = 2e-6
QUALITY = 8
failures = []


def check(what, good, detail=""):
    print(f"{'ok  ' if good else 'FAIL'} {what}{': ' if detail else ''}{detail}")
    if not good:
        failures.append(what)


def fresh(make, **arguments):
    """The object that an operator of Blender adds to an empty scene."""
    for shown in list(bpy.data.objects):
        bpy.data.objects.remove(shown, do_unlink=True)
    make(**arguments)
    return bpy.context.active_object


def made(name, points, faces):
    """A new object with this mesh, active, in an empty scene."""
    for shown in list(bpy.data.objects):
        bpy.data.objects.remove(shown, do_unlink=True)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    shown = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(shown)
    bpy.context.view_layer.objects.active = shown
    return shown


def coordinates(data):
    points = np.empty(3 * len(data), dtype=np.float32)
    data.foreach_get("co", points)
    return points.reshape(-1, 3).astype(float)


def evaluated(shown, write=None, quality=QUALITY):
    """Vertices of the limit surface at the vertices of the mesh, as Blender evaluates it; all of it into a file."""
    modifier = next(m for m in shown.modifiers if m.type == "SUBSURF")
    modifier.quality = quality
    of = shown.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = of.to_mesh()
    points = coordinates(mesh.vertices)
    if write is not None:
        lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in points]
        lines += ["f " + " ".join(str(v + 1) for v in face.vertices) for face in mesh.polygons]
        write.write_text("\n".join(lines) + "\n")
    of.to_mesh_clear()
    return points[: len(shown.data.vertices)]


def size(points):
    return np.linalg.norm(np.ptp(points, axis=0))


def run(**flags):
    """Whether the operator finished, and what it said where it did not."""
    try:
        return bpy.ops.mesh.limitlab_interpolate(**flags) == {"FINISHED"}, ""
    except RuntimeError as refusal:
        return False, str(refusal).strip()


def on_points(what, shown, folder, which=None, **flags):
    """Runs the operator; the surface has to meet the vertices of `which`, or all."""
    given = coordinates(shown.data.vertices)
    finished, said = run(**flags)
    check(f"{what}: finished", finished, said)
    if finished:
        write = folder / f"{what.replace(' ', '-').replace(',', '')}.obj" if folder else None
        rows = slice(None) if which is None else which
        distance, coarse, default = (
            np.linalg.norm((found - given)[rows], axis=1).max() / size(given)
            for found in (evaluated(shown, write), evaluated(shown, quality=6), evaluated(shown, quality=3))
        )
        moved = np.linalg.norm(coordinates(shown.data.vertices) - given, axis=1)
        detail = f"{distance:.1e} of the size ({coarse:.1e} at quality 6, {default:.1e} at 3)"
        check(f"{what}: on the points", distance <= ALLOWED, detail)
        return given, moved
    return given, None


def main():
    program = pathlib.Path(sys.argv[1]).resolve()
    folder = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else None
    if folder:
        folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        archive = pack.pack(pathlib.Path(scratch))
        bpy.ops.preferences.addon_install(filepath=str(archive), overwrite=True)
    bpy.ops.preferences.addon_enable(module="limitlab_addon")
    bpy.context.preferences.addons["limitlab_addon"].preferences.program = str(program)
    import limitlab_addon

    print(f"engine: {type(limitlab_addon.engine(bpy.context)).__name__}")

    shown = fresh(bpy.ops.mesh.primitive_monkey_add)
    uv = shown.data.uv_layers.new(name="uv") if not shown.data.uv_layers else shown.data.uv_layers[0]
    shown.data.materials.append(bpy.data.materials.new("paint"))
    before = np.array([tuple(entry.vector) for entry in uv.uv])
    on_points("suzanne", shown, folder)
    after = np.array([tuple(entry.vector) for entry in shown.data.uv_layers[0].uv])
    check(
        "suzanne: texture coordinates and materials are kept",
        np.array_equal(before, after) and shown.data.materials[0].name == "paint",
    )
    modifier = shown.modifiers[0]
    check("suzanne: the modifier shows the limit surface", modifier.type == "SUBSURF" and modifier.use_limit_surface)

    for weight in (1.0, 0.5):
        shown = fresh(bpy.ops.mesh.primitive_torus_add, major_segments=24, minor_segments=12)
        creases = shown.data.attributes.new("crease_edge", "FLOAT", "EDGE")
        radius = np.hypot(*coordinates(shown.data.vertices)[:, :2].T)
        for edge in shown.data.edges:
            circle = all(abs(radius[v] - radius.max()) < 1e-5 for v in edge.vertices)
            creases.data[edge.index].value = weight if circle else 0.0
        count = sum(entry.value > 0 for entry in creases.data)
        check(f"torus with creases of {weight}: its outer circle is creased", count == 24, f"{count} edges")
        on_points(f"torus with creases of {weight}", shown, folder)

    for rule in ("PRESERVE_CORNERS", "ALL"):
        shown = fresh(bpy.ops.mesh.primitive_grid_add, x_subdivisions=8, y_subdivisions=6)
        generator = np.random.default_rng(1)
        points = coordinates(shown.data.vertices) + 0.05 * generator.standard_normal((len(shown.data.vertices), 3))
        shown.data.vertices.foreach_set("co", points.astype(np.float32).ravel())
        modifier = shown.modifiers.new("Subdivision", "SUBSURF")
        modifier.boundary_smooth = rule
        on_points(f"open grid, {rule}", shown, folder)

    shown = fresh(bpy.ops.mesh.primitive_uv_sphere_add, segments=16, ring_count=8)
    chosen = coordinates(shown.data.vertices)[:, 2] > 0.1
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    bpy.ops.object.mode_set(mode="OBJECT")
    shown.data.vertices.foreach_set("select", chosen)
    _, moved = on_points("sphere, upper half selected", shown, folder, chosen, only_selected=True)
    check("sphere: the others stay", moved is not None and not moved[~chosen].any() and moved[chosen].max() > 1e-3)

    shown = fresh(bpy.ops.mesh.primitive_ico_sphere_add, subdivisions=2)
    shown.shape_key_add(name="Basis")
    key = shown.shape_key_add(name="tall")
    points = coordinates(key.data) * (1.0, 1.0, 2.0)
    key.data.foreach_set("co", points.astype(np.float32).ravel())
    key.value = 0.0
    on_points("shape keys, basis", shown, folder)
    for value in (1.0, 0.5):
        key.value = value
        wanted = points * value + points / (1.0, 1.0, 2.0) * (1.0 - value)
        distance = np.linalg.norm(evaluated(shown) - wanted, axis=1).max() / size(wanted)
        check(f"shape keys, tall at {value}: on the points", distance <= ALLOWED, f"{distance:.1e} of the size")

    # Three faces on the edge from 0 to 1.
    fan = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, -1, 0)], [(0, 1, 2), (1, 0, 3), (0, 1, 4)]
    shown = made("fan", *fan)
    given = coordinates(shown.data.vertices)
    finished, said = run()
    check("three faces on an edge are refused", not finished, said)
    check("  in edit mode", shown.mode == "EDIT")
    bpy.ops.object.mode_set(mode="OBJECT")
    chosen = {tuple(sorted(edge.vertices)) for edge in shown.data.edges if edge.select}
    check("  with the edge selected", (0, 1) in chosen, str(sorted(chosen)))
    check("  and nothing moved", np.array_equal(given, coordinates(shown.data.vertices)) and not shown.modifiers)

    # A cube: all valences 3, and no odd cycle of edges: the matrix is singular, and these points are not in its range.
    shown = fresh(bpy.ops.mesh.primitive_cube_add)
    points = coordinates(shown.data.vertices)
    points[0] *= 1.5
    shown.data.vertices.foreach_set("co", points.astype(np.float32).ravel())
    finished, said = run()
    check("a cube with a corner moved is refused", not finished and shown.mode == "OBJECT", said)

    shown = fresh(bpy.ops.mesh.primitive_uv_sphere_add, segments=8, ring_count=6)
    shown.modifiers.new("Mirror", "MIRROR")
    finished, said = run()
    check("a modifier before the subdivision is refused", not finished and "Mirror" in said, said)

    shown = fresh(bpy.ops.mesh.primitive_uv_sphere_add, segments=8, ring_count=6)
    shown.data.vertices.foreach_set("select", np.zeros(len(shown.data.vertices), dtype=bool))
    finished, said = run(only_selected=True)
    check("no vertex selected is refused", not finished, said)

    bpy.ops.preferences.addon_disable(module="limitlab_addon")
    check("disabled without a word", True)
    print(f"{len(failures)} failures")
    return int(bool(failures))


if __name__ == "__main__":
    sys.exit(main())
