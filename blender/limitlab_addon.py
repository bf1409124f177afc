"""Interpolate with limit surface: control points whose Catmull-Clark limit surface passes through a mesh's vertices.

Where the package `limitlab` is installed in Blender's Python, it computes them; else the program `interpolate` does,
whose place is asked for in the preferences of the add-on, or which is found on the path.

Coordinates of a mesh P become control points V with A V = P, where A is the matrix of limit positions under
the creases of the mesh and the rule of its boundary (see README.md beside this file).
"""

import json
import os
import pathlib
import shutil
import subprocess
import tempfile

import bmesh
import bpy
import numpy as np

try:
    import limitlab
except ImportError:
    limitlab = None

bl_info = {
    "name": "Interpolate with Limit Surface",
    "author": "limitlab",
    "version": (0, 1, 0),
    "blender": (4, 2, 0),
    "location": "Edit, Object and Mesh menus, or F3: Interpolate with Limit Surface",
    "description": "Moves the vertices so that the Catmull-Clark limit surface passes through where they were",
    "category": "Mesh",
}

# Blender's boundary rules of a Subdivision Surface modifier, in the words of OpenSubdiv, USD and limitlab.
BOUNDARY = {"PRESERVE_CORNERS": "edge-and-corner", "ALL": "edge-only"}


class Refused(Exception):
    """Why a mesh has no such control points, with the defects of the mesh as a list of dictionaries."""

    def __init__(self, message, defects=()):
        super().__init__(message)
        self.defects = list(defects)


class Answer:
    """Control points (N × 3, float64), iterations, largest distance of limit and given points, name of the method."""

    def __init__(self, points, iterations, error, method):
        self.points, self.iterations, self.error, self.method = points, iterations, error, method


class Task:
    """What is interpolated: faces, sharp edges and vertices, rule of the boundary, and the vertices that take part."""

    def __init__(self, mesh, boundary, creased, only):
        loops, faces, edges = len(mesh.loops), len(mesh.polygons), len(mesh.edges)
        self.corners = np.empty(loops, dtype=np.int32)
        mesh.loops.foreach_get("vertex_index", self.corners)
        starts = np.empty(faces, dtype=np.int32)
        mesh.polygons.foreach_get("loop_start", starts)
        self.offsets = np.append(starts, loops).astype(np.int32)
        self.boundary = boundary
        self.only = only
        self.creases = np.empty((0, 2), dtype=np.int32), np.empty(0)
        self.sharp_vertices = np.empty(0, dtype=np.int32), np.empty(0)
        if creased:
            weights = attribute(mesh, "crease_edge", edges)
            ends = np.empty(2 * edges, dtype=np.int32)
            mesh.edges.foreach_get("vertices", ends)
            # Edges of no face are none of the surface.
            on_faces = np.zeros(edges, dtype=bool)
            used = np.empty(loops, dtype=np.int32)
            mesh.loops.foreach_get("edge_index", used)
            on_faces[used] = True
            sharp = (weights > 0) & on_faces
            self.creases = ends.reshape(-1, 2)[sharp], sharpness(weights[sharp])
            weights = attribute(mesh, "crease_vert", len(mesh.vertices))
            [sharp] = np.nonzero(weights > 0)
            self.sharp_vertices = sharp.astype(np.int32), sharpness(weights[sharp])


def attribute(mesh, name, count):
    """A float attribute of the mesh; zeros where it has none."""
    found = mesh.attributes.get(name)
    values = np.zeros(count, dtype=np.float32)
    if found is not None and len(found.data) == count:
        found.data.foreach_get("value", values)
    return values.astype(float)


def sharpness(weights):
    """Blender's weight c of a crease as OpenSubdiv's sharpness: 10 c², where 10 is sharp for ever."""
    return 10.0 * np.minimum(weights, 1.0) ** 2


def positions(data):
    """Positions of vertices, or of the points of a shape key, in double precision."""
    points = np.empty(3 * len(data), dtype=np.float32)
    data.foreach_get("co", points)
    return points.reshape(-1, 3).astype(float)


class Package:
    """The Python package, in this process."""

    def solve(self, task, points, tolerance):
        try:
            found = limitlab.interpolate(
                points,
                (task.corners, task.offsets),
                "catmull-clark",
                boundary=task.boundary,
                creases=task.creases,
                corners=task.sharp_vertices,
                vertices=task.only,
                tol=tolerance,
            )
        except limitlab.MeshError as error:
            raise Refused(reason(str(error)), error.defects) from error
        except (limitlab.ConvergenceError, limitlab.ComputationError) as error:
            raise Refused(reason(str(error))) from error
        return Answer(found.vertices, found.iterations, found.max_error, found.method)


class Program:
    """The program `interpolate`, by files in a temporary folder."""

    def __init__(self, path):
        self.path = path

    def solve(self, task, points, tolerance):
        with tempfile.TemporaryDirectory(prefix="limitlab-") as folder:
            folder = pathlib.Path(folder)
            write_ply(folder / "mesh.ply", points, task.corners, task.offsets)
            flags = ["--scheme", "catmull-clark", "--boundary", task.boundary, "--tol", repr(tolerance)]
            for flag, name, (where, sharp) in (
                ("--creases", "creases.txt", task.creases),
                ("--corners", "corners.txt", task.sharp_vertices),
            ):
                if len(sharp):
                    rows = np.column_stack([where, sharp])
                    np.savetxt(folder / name, rows, fmt=["%d"] * (rows.shape[1] - 1) + ["%.17g"])
                    flags += [flag, str(folder / name)]
            if task.only is not None:
                np.savetxt(folder / "only.txt", task.only, fmt="%d")
                flags += ["--vertices", str(folder / "only.txt")]
            command = [self.path, str(folder / "mesh.ply"), *flags]
            done = self.run([*command, "-o", str(folder / "cage.ply"), "--json", "--quiet"])
            # Status 2 comes with an answer too, where no method met the tolerance: a cage that misses is no cage.
            if done.returncode != 0:
                raise Refused(reason(said(done.stderr)), self.defects(folder / "mesh.ply", task))
            answer = json.loads(done.stdout)
            cage = read_ply_points(folder / "cage.ply", len(points))
            return Answer(cage, answer["iterations"], answer["max_error"], answer["method"])

    def defects(self, mesh, task):
        """What is wrong with the mesh, where the validator finds something; else nothing."""
        out = str(mesh.with_name("none.ply"))
        flags = ["--boundary", task.boundary, "--defects", "--json", "--quiet"]
        done = self.run([self.path, str(mesh), "-o", out, *flags])
        try:
            return json.loads(done.stdout).get("defects", [])
        except (ValueError, AttributeError):
            return []

    def run(self, command):
        # No window of a console opens on Windows.
        hidden = {"creationflags": subprocess.CREATE_NO_WINDOW} if os.name == "nt" else {}
        try:
            return subprocess.run(command, capture_output=True, text=True, check=False, **hidden)
        except OSError as error:
            raise Refused(f"{self.path}: {error.strerror or error}") from error


def reason(text):
    """What the library or the program says, without its advice in arguments or flags, which there are none of here."""
    parts = text.split("; ")
    return "; ".join(part for part in parts if "--" not in part and '="' not in part) or text


def said(text):
    """The message of a program that failed: its last line, without the file's name."""
    lines = [line for line in text.splitlines() if line.strip()]
    if not lines:
        return "the program interpolate failed without a word"
    return lines[-1].removeprefix("error: ").rpartition("mesh.ply: ")[2]


def write_ply(path, points, corners, offsets):
    """A binary PLY with vertices in double precision and faces as lists of 32-bit integers."""
    faces = len(offsets) - 1
    head = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(points)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {faces}\nproperty list int int vertex_indices\nend_header\n"
    )
    # Each face is the number of its corners, then these.
    words = np.empty(len(corners) + faces, dtype="<i4")
    counts = offsets[:-1] + np.arange(faces)
    of_corners = np.ones(len(words), dtype=bool)
    of_corners[counts] = False
    words[counts] = np.diff(offsets)
    words[of_corners] = corners
    path.write_bytes(head.encode("ascii") + points.astype("<f8").tobytes() + words.tobytes())


def read_ply_points(path, count):
    """The vertices of a binary PLY that limitlab wrote: x, y, z in double precision come first."""
    data = path.read_bytes()
    head, _, body = data.partition(b"end_header\n")
    if b"format binary_little_endian" not in head or b"property double x\n" not in head:
        raise Refused(f"{path.name}: not the binary PLY that was asked for")
    if b"element vertex %d\n" % count not in head:
        raise Refused(f"{path.name}: not one control point for each vertex")
    return np.frombuffer(body, dtype="<f8", count=3 * count).reshape(-1, 3)


def engine(context):
    """The package where it is installed, else the program of the preferences, or of the path."""
    if limitlab is not None:
        return Package()
    addon = context.preferences.addons.get(__name__)
    path = bpy.path.abspath(addon.preferences.program) if addon else ""
    path = path or shutil.which("interpolate")
    if not path:
        raise Refused(
            "neither the package limitlab nor the program interpolate was found: "
            "name the program in the preferences of this add-on"
        )
    return Program(path)


def subdivision(shown):
    """The first Subdivision Surface modifier of the object that is shown; None where it has none."""
    return next((m for m in shown.modifiers if m.type == "SUBSURF" and m.show_viewport), None)


def changes_faces(modifier):
    """Whether the modifier may give the next one another mesh than it got: generators but for subdivision itself."""
    return modifier.show_viewport and modifier.type in {
        "ARRAY", "BEVEL", "BOOLEAN", "BUILD", "DECIMATE", "EDGE_SPLIT", "MASK", "MIRROR", "MULTIRES", "NODES", "REMESH",
        "SCREW", "SKIN", "SOLIDIFY", "TRIANGULATE", "VOLUME_TO_MESH", "WELD", "WIREFRAME",
    }  # fmt: skip


def select_defects(shown, mesh, defects):
    """Selects the vertices, edges and faces at fault, and nothing else, in edit mode."""
    bpy.ops.object.mode_set(mode="EDIT")
    edit = bmesh.from_edit_mesh(mesh)
    for elements in (edit.verts, edit.edges, edit.faces):
        elements.ensure_lookup_table()
        for element in elements:
            element.select = False
    kinds = set()
    for defect in defects:
        vertex, other = defect.get("vertex"), defect.get("other_vertex")
        if other is not None:
            edge = edit.edges.get([edit.verts[vertex], edit.verts[other]])
            if edge is not None:
                edge.select_set(True)
                kinds.add("EDGE")
                continue
        if vertex is not None and vertex < len(edit.verts):
            edit.verts[vertex].select_set(True)
            kinds.add("VERT")
        elif defect.get("face") is not None:
            edit.faces[defect["face"]].select_set(True)
            kinds.add("FACE")
    # The finest kind shows all.
    kind = next((k for k in ("VERT", "EDGE", "FACE") if k in kinds), "VERT")
    bpy.context.tool_settings.mesh_select_mode = [kind == k for k in ("VERT", "EDGE", "FACE")]
    bmesh.update_edit_mesh(mesh, loop_triangles=False, destructive=False)


class MESH_OT_limitlab_interpolate(bpy.types.Operator):
    """Move the vertices so that the Catmull-Clark limit surface passes through where they are now"""

    bl_idname = "mesh.limitlab_interpolate"
    bl_label = "Interpolate with Limit Surface"
    bl_options = {"REGISTER", "UNDO"}

    only_selected: bpy.props.BoolProperty(
        name="Selected Vertices Only",
        description="The surface passes through the selected vertices; the other control points stay where they are",
        default=False,
    )
    tolerance: bpy.props.FloatProperty(
        name="Tolerance",
        description="Largest distance of the surface from a vertex, in parts of the size of the mesh",
        default=1e-9,
        min=1e-13,
        max=1e-2,
        precision=12,
    )
    add_modifier: bpy.props.BoolProperty(
        name="Add Subdivision Surface",
        description="Add a Subdivision Surface modifier with Use Limit Surface where there is none",
        default=True,
    )

    @classmethod
    def poll(cls, context):
        shown = context.active_object
        return shown is not None and shown.type == "MESH" and shown.mode in {"OBJECT", "EDIT"}

    def execute(self, context):
        shown = context.active_object
        mode = shown.mode
        # Edits of the mesh reach its data when edit mode ends.
        if mode == "EDIT":
            bpy.ops.object.mode_set(mode="OBJECT")
        try:
            message = self.interpolate(context, shown)
        except Refused as refused:
            if refused.defects:
                select_defects(shown, shown.data, refused.defects)
                self.report({"ERROR"}, f"{refused} (selected)")
            else:
                self.report({"ERROR"}, str(refused))
                if mode == "EDIT":
                    bpy.ops.object.mode_set(mode="EDIT")
            return {"CANCELLED"}
        if mode == "EDIT":
            bpy.ops.object.mode_set(mode="EDIT")
        self.report({"INFO"}, message)
        return {"FINISHED"}

    def interpolate(self, context, shown):
        mesh = shown.data
        if mesh.library is not None or shown.library is not None:
            raise Refused("the mesh is linked from another file: make it local first")
        if len(mesh.polygons) == 0:
            raise Refused("the mesh has no faces")
        modifier = subdivision(shown)
        if modifier is not None and modifier.subdivision_type != "CATMULL_CLARK":
            raise Refused(f"the modifier {modifier.name} is Simple, not Catmull-Clark: its surface is the mesh itself")
        before = shown.modifiers[: shown.modifiers.find(modifier.name)] if modifier else shown.modifiers[:]
        hindrance = next((m for m in before if changes_faces(m)), None)
        if hindrance is not None:
            raise Refused(
                f"the modifier {hindrance.name} changes the mesh before it is subdivided: apply it first, or move it "
                "behind the Subdivision Surface modifier"
            )
        boundary = BOUNDARY[modifier.boundary_smooth] if modifier else BOUNDARY["PRESERVE_CORNERS"]
        only = None
        if self.only_selected:
            chosen = np.empty(len(mesh.vertices), dtype=bool)
            mesh.vertices.foreach_get("select", chosen)
            only = np.nonzero(chosen)[0].astype(np.int32)
            if len(only) == 0:
                raise Refused("no vertex is selected")
        task = Task(mesh, boundary, modifier is None or modifier.use_creases, only)
        solver = engine(context)
        # Cages are linear in their points, so that those of the shape keys blend as the keys do. All are found before
        # any is written.
        keys = mesh.shape_keys.key_blocks if mesh.shape_keys else []
        answers = [solver.solve(task, positions(key.data), self.tolerance) for key in keys]
        answer = answers[0] if answers else solver.solve(task, positions(mesh.vertices), self.tolerance)
        for key, found in zip(keys, answers):
            key.data.foreach_set("co", found.points.astype(np.float32).ravel())
        mesh.vertices.foreach_set("co", answer.points.astype(np.float32).ravel())
        mesh.update()
        if modifier is None and self.add_modifier:
            modifier = shown.modifiers.new("Subdivision", "SUBSURF")
            modifier.levels, modifier.render_levels = 2, 3
            # At Blender's own 3 the smooth corners of an open mesh are 1e-3 of its size off; all else is exact.
            modifier.quality = 6
        if modifier is not None:
            modifier.use_limit_surface = True
        size = np.linalg.norm(np.ptp(positions(mesh.vertices), axis=0)) or 1.0
        return (
            f"{len(only) if only is not None else len(mesh.vertices)} vertices by {answer.method}, "
            f"{answer.iterations} iterations, largest error {answer.error / size:.1e} of the size"
            + (f"; {len(keys)} shape keys" if len(keys) > 1 else "")
        )


class LimitlabPreferences(bpy.types.AddonPreferences):
    bl_idname = __name__

    program: bpy.props.StringProperty(
        name="Program",
        description="The program interpolate, where the package limitlab is not installed in Blender's Python",
        subtype="FILE_PATH",
    )

    def draw(self, context):
        if limitlab is not None:
            self.layout.label(text=f"Computed by the package limitlab {limitlab.__version__}")
        else:
            self.layout.prop(self, "program")


def draw_menu(self, context):
    self.layout.separator()
    operator = self.layout.operator(MESH_OT_limitlab_interpolate.bl_idname)
    operator.only_selected = False


CLASSES = (LimitlabPreferences, MESH_OT_limitlab_interpolate)
MENUS = ("TOPBAR_MT_edit", "VIEW3D_MT_object", "VIEW3D_MT_edit_mesh")


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    for menu in MENUS:
        getattr(bpy.types, menu).append(draw_menu)


def unregister():
    for menu in MENUS:
        getattr(bpy.types, menu).remove(draw_menu)
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)


if __name__ == "__main__":
    register()
