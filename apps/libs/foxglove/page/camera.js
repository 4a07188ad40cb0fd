'use strict';
// Looks at a target from a distance. Angles: `around` is where it looks to in the plane (0: along x), `down` how steeply.
class Camera {
  constructor() {
    Object.assign(this, {target: [0, 0, 0], distance: 70, around: Math.PI / 2, down: 0.9, width: 1, height: 1});
  }
  look(size) {  // of the picture [pixels]; call after a change
    [this.width, this.height] = size;
    const {sin, cos} = Math, a = this.around, d = this.down;
    this.forward = [cos(d) * cos(a), cos(d) * sin(a), -sin(d)];
    this.right = [sin(a), -cos(a), 0];
    this.up = [sin(d) * cos(a), sin(d) * sin(a), cos(d)];
    this.eye = this.target.map((x, i) => x - this.distance * this.forward[i]);
    this.focus = 1.1 * Math.min(this.width, this.height);
    this.near = this.distance / 100;
  }
  // Where a point is: pixels, and metres in front of the eye.
  project(p) {
    const v = p.map((x, i) => x - this.eye[i]), dot = a => a[0] * v[0] + a[1] * v[1] + a[2] * v[2];
    const depth = dot(this.forward), f = this.focus / depth;
    return [this.width / 2 + f * dot(this.right), this.height / 2 - f * dot(this.up), depth];
  }
  // Where the plane at height z is seen at a pixel; null beyond the horizon.
  ground(x, y, z) {
    const u = (x - this.width / 2) / this.focus, v = (this.height / 2 - y) / this.focus;
    const ray = this.forward.map((f, i) => f + u * this.right[i] + v * this.up[i]);
    const s = (z - this.eye[2]) / ray[2];
    return s > 0 && s * Math.hypot(...ray) < 1e4 ? this.eye.map((e, i) => e + s * ray[i]) : null;
  }
  turn(dx, dy) {
    this.around -= dx * 0.006;
    this.down = Math.min(Math.PI / 2, Math.max(0.05, this.down + dy * 0.006));
  }
  move(dx, dy) {
    const s = this.distance / this.focus, steep = Math.max(0.3, Math.sin(this.down));
    const ahead = [Math.cos(this.around), Math.sin(this.around), 0];
    this.target = this.target.map((t, i) => t - s * (dx * this.right[i] - dy / steep * ahead[i]));
  }
  zoom(factor) { this.distance = Math.min(3000, Math.max(3, this.distance * factor)); }
  // For the GPU, column by column: from points at a pose, relative to `origin`, to the cube that is seen.
  matrix({t, q}, origin) {
    const far = 100 * this.distance + 1000, n = this.near, {focus: f, width: w, height: h} = this;
    const columns = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map(axis => rotate(q, axis));
    const start = rotate(q, origin).map((x, i) => x + t[i] - this.eye[i]);
    return new Float32Array([...columns, start].flatMap((v, k) => {
      const dot = a => a[0] * v[0] + a[1] * v[1] + a[2] * v[2], depth = dot(this.forward);
      const z = (far + n) / (far - n) * depth - (k === 3 ? 2 * far * n / (far - n) : 0);
      return [2 * f / w * dot(this.right), 2 * f / h * dot(this.up), z, depth];
    }));
  }
}
