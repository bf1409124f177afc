// Surfaces in WebGL 2: faces flat, coloured by a byte a vertex; edges as strips of even width, a little nearer to the eye than
// the faces, so that they do not fight for depth.

const FACE_VERTEX = `#version 300 es
in vec3 point; in float error; uniform mat4 matrix; uniform mat3 turn; out vec3 place; out float colour;
void main() { place = turn * point; colour = error; gl_Position = matrix * vec4(point, 1.0); }`;
const FACE_FRAGMENT = `#version 300 es
precision highp float;
in vec3 place; in float colour; uniform sampler2D colours; out vec4 pixel;
void main() {
  vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
  float light = 0.45 + 0.6 * abs(dot(normal, normalize(vec3(0.35, 0.5, 0.8))));
  float size = float(textureSize(colours, 0).x);
  pixel = vec4(light * texture(colours, vec2((colour * (size - 1.0) + 0.5) / size, 0.5)).rgb, 1.0);
}`;
const EDGE_VERTEX = `#version 300 es
in vec3 from; in vec3 to; uniform mat4 matrix; uniform vec2 size; uniform float width; uniform float nearer;
void main() {
  vec4 a = matrix * vec4(from, 1.0), b = matrix * vec4(to, 1.0), p = gl_VertexID < 2 ? a : b;
  vec2 along = (b.xy / b.w - a.xy / a.w) * size;
  vec2 across = length(along) > 0.0 ? vec2(-along.y, along.x) / length(along) : vec2(1.0, 0.0);
  p.xy += across * (gl_VertexID % 2 == 0 ? -width : width) / size * p.w;
  p.z -= nearer * p.w;
  gl_Position = p;
}`;
const EDGE_FRAGMENT = `#version 300 es
precision highp float; uniform vec4 ink; out vec4 pixel; void main() { pixel = ink; }`;

/** A program with its uniforms by name; attributes have the places of their order in `attributes`. */
function programOf(gl, vertex, fragment, attributes) {
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  attributes.forEach((name, k) => gl.bindAttribLocation(program, k, name));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  return { program, uniform: name => gl.getUniformLocation(program, name) };
}

/** Triangles and edges of faces whose last corners have the highest bit set. */
function facesOf(corners) {
  const triangles = [], edges = [], seen = new Set();
  let start = 0;
  for (let k = 0; k < corners.length; k++) {
    if (corners[k] >>> 31 === 0) continue;
    const face = Array.from(corners.subarray(start, k + 1), v => v & 0x7fffffff);
    start = k + 1;
    for (let i = 2; i < face.length; i++) triangles.push(face[0], face[i - 1], face[i]);
    face.forEach((a, i) => {
      const b = face[(i + 1) % face.length], key = Math.min(a, b) * 2 ** 26 + Math.max(a, b);
      if (!seen.has(key)) { seen.add(key); edges.push(a, b); }
    });
  }
  return { triangles: new Uint32Array(triangles), edges: new Uint32Array(edges) };
}

/** Both ends of every edge, one edge after the other. */
function endsOf(points, edges) {
  const ends = new Float32Array(3 * edges.length);
  edges.forEach((v, k) => ends.set(points.subarray(3 * v, 3 * v + 3), 3 * k));
  return ends;
}

/**
 * Draws surfaces on a canvas; `null` without WebGL 2. `colours` are bytes of red, green and blue. A surface has `points`,
 * `corners`, `creases`; what is shown is one with its `edges` or those of another.
 */
function viewOn(canvas, colours) {
  const gl = canvas.getContext('webgl2', { antialias: true, preserveDrawingBuffer: true });
  if (!gl) return null;
  const face = programOf(gl, FACE_VERTEX, FACE_FRAGMENT, ['point', 'error']);
  const edge = programOf(gl, EDGE_VERTEX, EDGE_FRAGMENT, ['from', 'to']);
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB8, colours.length / 3, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, colours);
  for (const [name, value] of [
    [gl.TEXTURE_MIN_FILTER, gl.LINEAR], [gl.TEXTURE_MAG_FILTER, gl.LINEAR],
    [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE],
  ]) gl.texParameteri(gl.TEXTURE_2D, name, value);
  const buffer = (target, data) => {
    const made = gl.createBuffer();
    gl.bindBuffer(target, made);
    gl.bufferData(target, data, gl.STATIC_DRAW);
    return made;
  };
  const errorBuffer = gl.createBuffer();
  const camera = { yaw: 0.6, pitch: 0.35, distance: 3.1 };

  /** A surface on the device. */
  const load = ({ points, corners, creases }) => {
    const { triangles, edges } = facesOf(corners);
    return {
      points: buffer(gl.ARRAY_BUFFER, points),
      triangles: buffer(gl.ELEMENT_ARRAY_BUFFER, triangles),
      corners: triangles.length,
      edges: { ends: buffer(gl.ARRAY_BUFFER, endsOf(points, edges)), count: edges.length / 2 },
      creases: { ends: buffer(gl.ARRAY_BUFFER, endsOf(points, creases)), count: creases.length / 2 },
    };
  };

  const strips = ({ ends, count }, matrix, ink, width, nearer) => {
    if (count === 0) return;
    gl.useProgram(edge.program);
    gl.uniformMatrix4fv(edge.uniform('matrix'), false, matrix);
    gl.uniform2f(edge.uniform('size'), canvas.width, canvas.height);
    gl.uniform1f(edge.uniform('width'), width);
    gl.uniform1f(edge.uniform('nearer'), nearer);
    gl.uniform4fv(edge.uniform('ink'), ink);
    gl.bindBuffer(gl.ARRAY_BUFFER, ends);
    for (const [place, offset] of [[0, 0], [1, 12]]) {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 24, offset);
      gl.vertexAttribDivisor(place, 1);
    }
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count);
    for (const place of [0, 1]) gl.vertexAttribDivisor(place, 0);
  };

  /** Draws `solid` with a byte of error a vertex, the edges of `cage` if there are any, and creases. */
  const show = ({ solid, errors, cage, inks }) => {
    const ratio = window.devicePixelRatio || 1;
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio)), height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    const { yaw, pitch, distance } = camera;
    const [cy, sy, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
    // By columns: about the vertical axis, then towards the eye.
    const turn = [cy, sy * sp, -sy * cp, 0, cp, sp, sy, -cy * sp, cy * cp];
    // The surface is about as large as the ball of radius 1.
    const near = Math.max(0.05, distance - 1.5), far = distance + 3;
    const focal = 1 / Math.tan(0.35) * Math.min(1, width / height);
    const scale = [focal * height / width, focal, (far + near) / (near - far)];
    const matrix = new Float32Array(16);
    for (let c = 0; c < 3; c++) {
      for (let r = 0; r < 3; r++) matrix[4 * c + r] = scale[r] * turn[3 * c + r];
      matrix[4 * c + 3] = -turn[3 * c + 2];
    }
    matrix[14] = -scale[2] * distance + 2 * far * near / (near - far);
    matrix[15] = distance;
    gl.useProgram(face.program);
    gl.uniformMatrix4fv(face.uniform('matrix'), false, matrix);
    gl.uniformMatrix3fv(face.uniform('turn'), false, turn);
    gl.bindBuffer(gl.ARRAY_BUFFER, solid.points);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    gl.bindBuffer(gl.ARRAY_BUFFER, errorBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, errors, gl.DYNAMIC_DRAW);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(1, 1, gl.UNSIGNED_BYTE, true, 0, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, solid.triangles);
    gl.drawElements(gl.TRIANGLES, solid.corners, gl.UNSIGNED_INT, 0);
    if (cage) strips(cage.edges, matrix, inks.edge, 0.6 * ratio, 3e-3);
    for (const of of cage && cage !== solid ? [solid, cage] : [solid]) strips(of.creases, matrix, inks.crease, 1.6 * ratio, 4e-3);
  };
  return { load, show, camera };
}
