'use strict';
// Messages of ROS 2 in CDR, as far as this page shows them. Stamps are seconds; a pose is {t: [x, y, z], q: [x, y, z, w]}.
class Cdr {
  constructor(view) {
    this.view = view;
    this.little = (view.getUint8(1) & 1) === 1;
    this.at = 4;
  }
  number(name, size) {  // aligned to its size after the 4 bytes of the header
    this.at = 4 + Math.ceil((this.at - 4) / size) * size;
    this.at += size;
    return this.view['get' + name](this.at - size, this.little);
  }
  u8() { return this.number('Uint8', 1); }
  u32() { return this.number('Uint32', 4); }
  f64() { return this.number('Float64', 8); }
  bytes(count) {
    this.at += count;
    return new DataView(this.view.buffer, this.view.byteOffset + this.at - count, count);
  }
  text() { return new TextDecoder().decode(this.bytes(this.u32())).replace(/\0$/, ''); }
  list(item) { return Array.from({length: this.u32()}, item); }
  numbers(count) { return Array.from({length: count}, () => this.f64()); }
  header() {
    const stamp = this.number('Int32', 4) + this.u32() * 1e-9;
    return {stamp, frame: this.text().replace(/^\//, '')};
  }
  pose() { return {t: this.numbers(3), q: this.numbers(4)}; }
}

const readPose = cdr => ({...cdr.header(), pose: cdr.pose(), covariance: cdr.numbers(36)});
const readPath = cdr => ({...cdr.header(), poses: cdr.list(() => (cdr.header(), cdr.pose()))});
const readTransforms = cdr => cdr.list(() => ({...cdr.header(), child: cdr.text().replace(/^\//, ''), pose: cdr.pose()}));
const readDiagnostics = cdr => ({...cdr.header(), status: cdr.list(() => ({level: cdr.u8(), name: cdr.text(), message: cdr.text(),
  hardware: cdr.text(), values: new Map(cdr.list(() => [cdr.text(), cdr.text()]))}))});

// At most `most` points of a PointCloud2, evenly over it, relative to `origin`, its first point: GPUs have few digits.
const readCloud = (cdr, most) => {
  const {stamp, frame} = cdr.header();
  const height = cdr.u32(), width = cdr.u32(), places = {};
  cdr.list(() => {
    const name = cdr.text(), offset = cdr.u32(), type = cdr.u8();
    cdr.u32();
    if (type === 7 || type === 8) places[name] = [offset, type === 7 ? 'getFloat32' : 'getFloat64'];
  });
  const little = cdr.u8() === 0, step = cdr.u32(), rowStep = cdr.u32(), data = cdr.bytes(cdr.u32());
  const axes = [places.x, places.y, places.z];
  if (!axes.every(Boolean)) return {stamp, frame, total: height * width, origin: [0, 0, 0], xyz: new Float32Array(0)};
  const total = height * width, stride = Math.max(1, total / most);
  const xyz = new Float32Array(3 * Math.min(total, most));
  let used = 0, origin = null;
  for (let at = 0; at < total && used < xyz.length; at += stride) {
    const i = Math.floor(at), start = Math.floor(i / width) * rowStep + (i % width) * step;
    const p = axes.map(([offset, get]) => data[get](start + offset, little));
    if (!p.every(Number.isFinite)) continue;
    origin = origin || p;
    for (let c = 0; c < 3; ++c) xyz[used++] = p[c] - origin[c];
  }
  return {stamp, frame, total, origin: origin || [0, 0, 0], xyz: xyz.subarray(0, used)};
};

// Rigid transforms.
const rotate = ([x, y, z, w], [a, b, c]) => {
  const u = 2 * (y * c - z * b), v = 2 * (z * a - x * c), s = 2 * (x * b - y * a);
  return [a + w * u + y * s - z * v, b + w * v + z * u - x * s, c + w * s + x * v - y * u];
};
const compose = (A, B) => {
  const [x, y, z, w] = A.q, [a, b, c, d] = B.q, moved = rotate(A.q, B.t);
  return {t: A.t.map((v, i) => v + moved[i]),
    q: [w * a + x * d + y * c - z * b, w * b - x * c + y * d + z * a, w * c + x * b - y * a + z * d, w * d - x * a - y * b - z * c]};
};
const identity = () => ({t: [0, 0, 0], q: [0, 0, 0, 1]});
const yawOf = ({q: [x, y, z, w]}) => Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));

// The last transform to each frame from its parent.
class Frames {
  constructor() { this.links = new Map(); }
  add(transforms, isStatic) {
    for (const one of transforms) this.links.set(one.child, {...one, isStatic});
  }
  // The pose of `child` in `root`; null if none is known, or only one before `stamp`.
  pose(root, child, stamp) {
    let found = identity();
    for (let steps = 0; child !== root; ++steps) {
      const link = this.links.get(child);
      if (!link || steps > 20 || (!link.isStatic && link.stamp < stamp)) return null;
      found = compose(link.pose, found);
      child = link.frame;
    }
    return found;
  }
}
