// The arm in 3D with WebGL 2; matrices are column-major. Names follow T_a_b, the pose of b in a.
"use strict";

const mat = {
  mul(a, b) {
    const m = new Float32Array(16);
    for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) {
      m[4 * c + r] = a[r] * b[4 * c] + a[4 + r] * b[4 * c + 1] + a[8 + r] * b[4 * c + 2] + a[12 + r] * b[4 * c + 3];
    }
    return m;
  },
  identity: () => new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]),
  turn([x, y, z], angle, [px, py, pz]) {  // Rotation about an axis through the point p.
    const c = Math.cos(angle), s = Math.sin(angle), k = 1 - c;
    return new Float32Array([
      k * x * x + c, k * x * y + s * z, k * x * z - s * y, 0, k * x * y - s * z, k * y * y + c, k * y * z + s * x, 0,
      k * x * z + s * y, k * y * z - s * x, k * z * z + c, 0, px, py, pz, 1]);
  },
  perspective(fov, aspect, near, far) {
    const f = 1 / Math.tan(fov / 2), d = 1 / (near - far);
    return new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) * d, -1, 0, 0, 2 * far * near * d, 0]);
  },
  look(eye, at) {
    const unit = (v) => { const l = Math.hypot(...v); return v.map((x) => x / l); };
    const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    const z = unit(eye.map((x, i) => x - at[i])), x = unit(cross([0, 0, 1], z)), y = cross(z, x);
    return new Float32Array([x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, -dot(x, eye), -dot(y, eye), -dot(z, eye), 1]);
  },
};

const SHADERS = {
  arm: [`#version 300 es
    uniform mat4 view, model; in vec3 place, normal; out vec3 n, p;
    void main() { vec4 w = model * vec4(place, 1.0); p = w.xyz; n = mat3(model) * normal; gl_Position = view * w; }`,
  `#version 300 es
    precision highp float; uniform vec4 color; uniform vec3 eye; in vec3 n, p; out vec4 o;
    void main() {
      vec3 N = normalize(n), V = normalize(eye - p), L = normalize(vec3(0.45, -0.55, 0.9)), H = normalize(L + V);
      float sky = 0.5 + 0.5 * N.z, key = max(dot(N, L), 0.0), back = max(dot(N, normalize(vec3(-0.7, 0.5, 0.25))), 0.0);
      vec3 light = mix(vec3(0.40, 0.42, 0.46), vec3(0.66, 0.69, 0.74), sky) + key * vec3(0.42, 0.41, 0.38) + back * 0.10;
      float shine = 0.22 * pow(max(dot(N, H), 0.0), 48.0), rim = 0.10 * pow(1.0 - max(dot(N, V), 0.0), 3.0);
      o = vec4((color.rgb * light + shine + rim) * color.a, color.a);
    }`],
  flat: [`#version 300 es
    uniform mat4 view, model; uniform float ground; in vec3 place; out vec3 p;
    void main() { vec4 w = model * vec4(place, 1.0); w.xyz -= (w.z - ground) * vec3(0.5, -0.61, 1.0); w.z = ground + 0.001; p = w.xyz; gl_Position = view * w; }`,
  `#version 300 es
    precision highp float; uniform vec4 color; in vec3 p; out vec4 o;
    void main() { o = vec4(0.07, 0.12, 0.2, 1.0) * 0.20 * (1.0 - smoothstep(0.6, 1.9, length(p.xy))); }`],
  ground: [`#version 300 es
    uniform mat4 view; in vec3 place; out vec2 p;
    void main() { p = place.xy; gl_Position = view * vec4(place, 1.0); }`,
  `#version 300 es
    precision highp float; in vec2 p; out vec4 o;
    float lines(float step, float width) {
      vec2 q = p / step, d = abs(fract(q - 0.5) - 0.5) / (fwidth(q) * width);
      return 1.0 - min(min(d.x, d.y), 1.0);
    }
    void main() {
      float fade = 1.0 - smoothstep(0.7, 2.6, length(p)), a = max(0.30 * lines(0.1, 1.0), 0.62 * lines(0.5, 1.4)) * fade;
      o = vec4(vec3(0.55, 0.62, 0.71) * a, a);
    }`],
  path: [`#version 300 es
    uniform mat4 view; uniform vec2 size; uniform float width; in vec3 place, ahead, tint; in float side; out vec3 c;
    void main() {
      vec4 a = view * vec4(place, 1.0), b = view * vec4(ahead, 1.0); vec2 d = (b.xy / b.w - a.xy / a.w) * size;
      vec2 across = length(d) > 1e-6 ? normalize(vec2(-d.y, d.x)) : vec2(0.0, 1.0);
      a.xy += across * side * width / size * a.w; c = tint; gl_Position = a;
    }`,
  `#version 300 es
    precision highp float; uniform float alpha; in vec3 c; out vec4 o; void main() { o = vec4(c * alpha, alpha); }`],
};

class Scene {
  constructor(canvas, arm, path, array) {
    this.canvas = canvas; this.arm = arm;
    const gl = this.gl = canvas.getContext("webgl2", { antialias: true, alpha: true, stencil: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("no WebGL 2");
    this.programs = Object.fromEntries(Object.entries(SHADERS).map(([name, source]) => [name, this.link(...source)]));
    this.meshes = arm.meshes.map((mesh) => ({ ...mesh, ...this.upload(array(mesh.vertices), array(mesh.faces)) }));
    const z = arm.floor;
    this.ground = this.buffer(new Float32Array([-3, -3, z, 3, -3, z, -3, 3, z, 3, 3, z]));
    this.paths = path ? this.makePaths(path, array) : [];
    this.camera = { yaw: -0.83, pitch: 0.36, distance: 3.15, at: [0.06, 0.0, 0.5] };
    this.steer();
  }

  link(vertex, fragment) {
    const gl = this.gl, program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source); gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    return program;
  }

  buffer(data, kind = this.gl.ARRAY_BUFFER) {
    const gl = this.gl, buffer = gl.createBuffer();
    gl.bindBuffer(kind, buffer); gl.bufferData(kind, data, gl.STATIC_DRAW);
    return buffer;
  }

  upload(vertices, faces) {
    const normals = new Float32Array(vertices.length), v = vertices;
    for (let i = 0; i < faces.length; i += 3) {
      const [a, b, c] = [3 * faces[i], 3 * faces[i + 1], 3 * faces[i + 2]];
      const ux = v[b] - v[a], uy = v[b + 1] - v[a + 1], uz = v[b + 2] - v[a + 2];
      const wx = v[c] - v[a], wy = v[c + 1] - v[a + 1], wz = v[c + 2] - v[a + 2];
      const n = [uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx];
      for (const k of [a, b, c]) for (let d = 0; d < 3; d++) normals[k + d] += n[d];
    }
    return { place: this.buffer(vertices), normal: this.buffer(normals), index: this.buffer(faces, this.gl.ELEMENT_ARRAY_BUFFER), count: faces.length };
  }

  makePaths(path, array) {
    const points = array(path.points), error = array(path.error);
    const stops = [[20, 150, 160], [60, 175, 90], [240, 150, 20], [214, 48, 38]];
    const tint = (i) => {
      if (error[i] !== error[i]) return [0.55, 0.58, 0.63];  // No reference.
      const x = Math.min(Math.max(error[i] / path.worst, 0), 1) * 3, k = Math.min(Math.floor(x), 2), f = x - k;
      return stops[k].map((c, d) => (c + (stops[k + 1][d] - c) * f) / 255);
    };
    const paths = [this.ribbon(points, tint, 3.2, 1)];
    if (path.plan) paths.unshift(this.ribbon(array(path.plan), () => [0.27, 0.55, 1], 6.5, 0.3));
    return paths;
  }

  ribbon(points, tint, width, alpha) {
    const rows = [], count = points.length / 3, at = (i) => points.subarray(3 * i, 3 * i + 3);
    for (let i = 0; i + 1 < count; i++) {
      const a = at(i), b = at(i + 1), ca = tint(i), cb = tint(i + 1);
      const behind = a.map((x, d) => 2 * x - b[d]), beyond = b.map((x, d) => 2 * x - a[d]);
      void behind;
      const corner = (p, q, c, s) => rows.push(...p, ...q, ...c, s);
      corner(a, b, ca, 1); corner(a, b, ca, -1); corner(b, beyond, cb, 1);
      corner(b, beyond, cb, 1); corner(a, b, ca, -1); corner(b, beyond, cb, -1);
    }
    return { buffer: this.buffer(new Float32Array(rows)), count: rows.length / 10, width, alpha };
  }

  links(q) {  // T_base_link of the base and of every link, from joint angles, [rad].
    const poses = [mat.identity()];
    this.arm.joints.forEach((joint, i) => poses.push(mat.mul(poses[i], mat.turn(joint.axis, q[i], joint.origin))));
    return poses;
  }

  show(q, planned) {
    const gl = this.gl, canvas = this.canvas, ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio)), height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    this.last = [q, planned];
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    const { yaw, pitch, distance, at } = this.camera;
    const eye = [at[0] + distance * Math.cos(pitch) * Math.cos(yaw), at[1] + distance * Math.cos(pitch) * Math.sin(yaw), at[2] + distance * Math.sin(pitch)];
    const shift = mat.identity(); shift[13] = 0.27;  // The tables cover the lower edge.
    const view = mat.mul(shift, mat.mul(mat.perspective(0.62, width / height, 0.05, 20), mat.look(eye, at)));
    const poses = this.links(q);
    gl.enable(gl.DEPTH_TEST); gl.enable(gl.BLEND); gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    this.drawGround(view);
    gl.enable(gl.STENCIL_TEST); gl.stencilFunc(gl.EQUAL, 0, 255); gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    gl.disable(gl.DEPTH_TEST);
    this.drawArm("flat", view, poses, eye);
    gl.disable(gl.STENCIL_TEST); gl.enable(gl.DEPTH_TEST); gl.depthMask(true);
    this.drawArm("arm", view, poses, eye);
    gl.depthMask(false);
    this.paths.forEach((path) => this.drawPath(path, view, width, height));
    if (planned && q.some((angle, i) => Math.abs(angle - planned[i]) > 2e-3)) {
      gl.depthMask(true); gl.colorMask(false, false, false, false);  // Draw only its nearest surface.
      this.drawArm("arm", view, this.links(planned), eye, [0.27, 0.55, 1, 0.34]);
      gl.colorMask(true, true, true, true); gl.depthFunc(gl.EQUAL);
      this.drawArm("arm", view, this.links(planned), eye, [0.27, 0.55, 1, 0.34]);
      gl.depthFunc(gl.LESS);
    }
    gl.depthMask(true);
  }

  use(name, view) {
    const gl = this.gl, program = this.programs[name];
    gl.useProgram(program);
    gl.uniformMatrix4fv(gl.getUniformLocation(program, "view"), false, view);
    return { program, uniform: (key) => gl.getUniformLocation(program, key) };
  }

  attribute(program, name, buffer, size, stride = 0, offset = 0) {
    const gl = this.gl, place = gl.getAttribLocation(program, name);
    if (place < 0) return;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer); gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, gl.FLOAT, false, stride, offset);
  }

  drawGround(view) {
    const { program } = this.use("ground", view);
    this.attribute(program, "place", this.ground, 3);
    this.gl.drawArrays(this.gl.TRIANGLE_STRIP, 0, 4);
  }

  drawArm(shader, view, poses, eye, tint) {
    const gl = this.gl, { program, uniform } = this.use(shader, view);
    gl.uniform3f(uniform("eye"), ...eye);
    gl.uniform1f(uniform("ground"), this.arm.floor);
    for (const mesh of this.meshes) {
      if ((tint && mesh.link === 0) || (shader === "flat" && mesh.casts === false)) continue;
      gl.uniformMatrix4fv(uniform("model"), false, poses[mesh.link]);
      gl.uniform4f(uniform("color"), ...(tint || [...mesh.color, 1]));
      this.attribute(program, "place", mesh.place, 3);
      this.attribute(program, "normal", mesh.normal, 3);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.index);
      gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_INT, 0);
    }
  }

  drawPath(path, view, width, height) {
    const gl = this.gl, { program, uniform } = this.use("path", view);
    gl.uniform2f(uniform("size"), width, height);
    gl.uniform1f(uniform("width"), path.width * Math.min(window.devicePixelRatio || 1, 2));
    gl.uniform1f(uniform("alpha"), path.alpha);
    [["place", 3, 0], ["ahead", 3, 12], ["tint", 3, 24], ["side", 1, 36]].forEach(([name, size, offset]) =>
      this.attribute(program, name, path.buffer, size, 40, offset));
    gl.drawArrays(gl.TRIANGLES, 0, path.count);
  }

  steer() {
    const { canvas, camera } = this, again = () => this.last && this.show(...this.last);
    let held = null;
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("pointerdown", (event) => { held = event; canvas.setPointerCapture(event.pointerId); });
    canvas.addEventListener("pointerup", () => { held = null; });
    canvas.addEventListener("pointermove", (event) => {
      if (!held) return;
      const dx = event.clientX - held.clientX, dy = event.clientY - held.clientY, button = held.button;
      held = { clientX: event.clientX, clientY: event.clientY, button };
      if (button === 2 || event.shiftKey) {
        const k = camera.distance / canvas.clientHeight;
        camera.at = [camera.at[0] + k * dx * Math.sin(camera.yaw), camera.at[1] - k * dx * Math.cos(camera.yaw), camera.at[2] + k * dy];
      } else {
        camera.yaw -= dx * 0.008; camera.pitch = Math.min(1.5, Math.max(-0.1, camera.pitch + dy * 0.008));
      }
      again();
    });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      camera.distance = Math.min(8, Math.max(0.5, camera.distance * Math.exp(event.deltaY * 0.001)));
      again();
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const turn = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
      if (!turn) return;
      event.preventDefault();
      camera.yaw += turn[0]; camera.pitch = Math.min(1.5, Math.max(-0.1, camera.pitch + turn[1]));
      again();
    });
    new ResizeObserver(again).observe(canvas);
  }
}
