'use strict';
// Clouds in WebGL, and lines over them on a plain canvas, which is there without WebGL, too.
class View {
  constructor(place) {
    this.place = place;
    this.camera = new Camera();
    [this.points, this.lines] = place.querySelectorAll('canvas');
    this.pen = this.lines.getContext('2d');
    this.clouds = new Map();
    this.pixels = 1;
    this.start();
    this.points.addEventListener('webglcontextlost', event => event.preventDefault());
    this.points.addEventListener('webglcontextrestored', () => {
      this.start();
      for (const cloud of this.clouds.values()) this.load(cloud);
      this.changed();
    });
    new ResizeObserver(() => this.changed()).observe(place);
    this.steer();
  }

  start() {
    const gl = this.gl = this.points.getContext('webgl', {antialias: false});
    if (!gl) return;
    const names = gl.getExtension('WEBGL_debug_renderer_info');
    this.isSlow = /swiftshader|llvmpipe|softpipe|software|basic render/i.test(gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
    const program = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, `
      attribute vec3 place, colour;
      uniform mat4 seen;
      uniform vec4 tint;
      uniform vec3 size;
      varying vec3 shade;
      void main() {
        gl_Position = seen * vec4(place, 1.0);
        gl_PointSize = clamp(size.x / gl_Position.w, size.y, size.z);
        shade = mix(colour, tint.rgb, tint.a);
      }`], [gl.FRAGMENT_SHADER, `
      precision mediump float;
      varying vec3 shade;
      void main() { gl_FragColor = vec4(shade, 1.0); }`]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.bindAttribLocation(program, 0, 'place');
    gl.bindAttribLocation(program, 1, 'colour');
    gl.linkProgram(program);
    gl.useProgram(program);
    gl.enable(gl.DEPTH_TEST);
    this.uniforms = Object.fromEntries(['seen', 'tint', 'size'].map(name => [name, gl.getUniformLocation(program, name)]));
  }

  // cloud: {xyz, origin, pose}; with `heights`, its lowest and highest, it is coloured by height. null takes it away.
  show(name, cloud) {
    const old = this.clouds.get(name);
    if (old && this.gl) old.buffers.forEach(buffer => this.gl.deleteBuffer(buffer));
    this.clouds.delete(name);
    if (cloud) this.clouds.set(name, cloud);
    if (cloud) this.load(cloud);
    this.changed();
  }
  load(cloud) {
    const gl = this.gl, {xyz, heights, origin} = cloud;
    if (!gl) return;
    const buffer = data => {
      const made = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, made);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      return made;
    };
    cloud.buffers = [buffer(xyz)];
    if (!heights) return;
    const [low, high] = heights, steps = Array.from({length: 256}, (_, i) => heightColour(i / 255).map(c => Math.round(255 * c)));
    const colours = new Uint8Array(xyz.length);
    for (let i = 0; i < xyz.length; i += 3) {
      const share = (xyz[i + 2] + origin[2] - low) / (high - low);
      colours.set(steps[Math.round(255 * Math.min(1, Math.max(0, share)))], i);
    }
    cloud.buffers.push(buffer(colours));
  }

  changed() {
    if (this.waits) return;
    this.waits = requestAnimationFrame(() => {
      this.waits = 0;
      this.draw();
    });
  }
  draw() {
    const scale = Math.min(devicePixelRatio, 2), size = [this.place.clientWidth, this.place.clientHeight];
    for (const canvas of [this.points, this.lines]) {
      const [w, h] = size.map(x => Math.round(x * scale));
      if (canvas.width !== w || canvas.height !== h) Object.assign(canvas, {width: w, height: h});
    }
    this.camera.look(size);
    this.drawPoints(scale);
    this.pen.setTransform(scale, 0, 0, scale, 0, 0);
    this.pen.clearRect(0, 0, ...size);
    this.over(this);
  }
  drawPoints(scale) {
    const gl = this.gl;
    if (!gl) return;
    const rgb = name => css(name).match(/\w\w/g).map(two => parseInt(two, 16) / 255);
    const isDark = css('color-scheme') === 'dark';
    gl.viewport(0, 0, this.points.width, this.points.height);
    gl.clearColor(...rgb('--faint'), 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    for (const {xyz, buffers, origin, pose, heights, tint, size, hidden} of this.clouds.values()) {
      if (hidden) continue;
      gl.uniformMatrix4fv(this.uniforms.seen, false, this.camera.matrix(pose, origin));
      gl.uniform4f(this.uniforms.tint, ...rgb(tint[0]), heights && isDark ? tint[1] / 3 : tint[1]);
      gl.uniform3f(this.uniforms.size, ...[size[0] * this.camera.focus, size[1], size[2]].map(x => x * scale));
      [[3, gl.FLOAT, false], [3, gl.UNSIGNED_BYTE, true]].forEach((kind, i) => {
        if (i === 1 && !heights) return gl.disableVertexAttribArray(1);
        gl.bindBuffer(gl.ARRAY_BUFFER, buffers[i]);
        gl.enableVertexAttribArray(i);
        gl.vertexAttribPointer(i, ...kind, 0, 0);
      });
      gl.drawArrays(gl.POINTS, 0, xyz.length / 3);
    }
  }

  // A line through points of the map; what is behind the eye is left out.
  line(points, colour, width, fill) {
    const pen = this.pen;
    let draws = false;
    pen.beginPath();
    for (const point of points) {
      const [x, y, depth] = this.camera.project(point);
      if (depth > this.camera.near) draws ? pen.lineTo(x, y) : pen.moveTo(x, y);
      draws = depth > this.camera.near;
    }
    Object.assign(pen, {strokeStyle: colour, lineWidth: width, lineJoin: 'round', lineCap: 'round'});
    if (fill) Object.assign(pen, {fillStyle: fill}), pen.fill();
    pen.stroke();
  }
  // An arrow that is as large on the screen from everywhere.
  robot(pose, colour, edge) {
    const s = 0.035 * this.camera.distance, at = (x, y) => rotate(pose.q, [s * x, s * y, 0]).map((v, i) => v + pose.t[i]);
    this.line([at(1, 0), at(-0.7, 0.6), at(-0.35, 0), at(-0.7, -0.6), at(1, 0)], edge, 2, colour);
  }
  scaleBar(colour) {
    const perMetre = this.camera.focus / this.camera.distance;
    const metres = [1000, 500, 200, 100, 50, 20, 10, 5, 2, 1, 0.5].find(m => m * perMetre < 140) || 0.2;
    const right = this.camera.width - 14, bottom = this.camera.height - 14;
    Object.assign(this.pen, {font: '12px system-ui, sans-serif', fillStyle: colour, textAlign: 'right'});
    this.pen.fillRect(right - metres * perMetre, bottom, metres * perMetre, 2);
    this.pen.fillText(metres + ' m', right, bottom - 6);
  }

  // Fingers and mice. While `pointing` is set, one pointer is given to it: (phase, x, y).
  steer() {
    const down = new Map(), area = this.lines;
    const spot = event => [event.offsetX, event.offsetY];
    area.addEventListener('pointerdown', event => {
      area.setPointerCapture(event.pointerId);
      down.set(event.pointerId, {at: spot(event), moves: event.button > 0 || event.shiftKey});
      if (this.pointing) this.pointing(down.size === 1 ? 'down' : 'off', ...spot(event));
    });
    area.addEventListener('pointermove', event => {
      const one = down.get(event.pointerId);
      if (!one) return;
      const [x, y] = spot(event), [dx, dy] = [x - one.at[0], y - one.at[1]];
      const other = [...down.values()].find(another => another !== one);
      if (this.pointing) return this.pointing('move', x, y);
      if (other) {
        const apart = ([a, b]) => Math.max(1, Math.hypot(a - other.at[0], b - other.at[1]));
        this.camera.zoom(apart(one.at) / apart([x, y]));
      }
      if (other || one.moves) this.camera.move(dx / down.size, dy / down.size);
      else this.camera.turn(dx, dy);
      if (other || one.moves) this.moved();
      one.at = [x, y];
      this.changed();
    });
    for (const name of ['pointerup', 'pointercancel']) {
      area.addEventListener(name, event => {
        if (down.delete(event.pointerId) && this.pointing) this.pointing(name === 'pointerup' ? 'up' : 'off', ...spot(event));
      });
    }
    area.addEventListener('contextmenu', event => event.preventDefault());
    area.addEventListener('wheel', event => {
      event.preventDefault();
      this.camera.zoom(Math.exp(event.deltaY * (event.deltaMode ? 0.05 : 0.0015)));
      this.changed();
    }, {passive: false});
  }
}
