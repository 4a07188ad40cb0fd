'use strict';
(() => {
  const place = document.getElementById('view3d');
  if (!place) return;
  const data = JSON.parse(document.getElementById('view3d-data').textContent);
  const say = words => { place.querySelector('.none').textContent = words; };

  const positions = cloud => {
    const text = atob(cloud.data), out = new Float32Array(3 * cloud.count);
    for (let i = 0; i < out.length; ++i) {
      const axis = i % 3;
      out[i] = cloud.origin[axis] + cloud.step[axis] * (text.charCodeAt(2 * i) | text.charCodeAt(2 * i + 1) << 8);
    }
    return out;
  };
  const heightColours = xyz => {
    const [low, high] = data.heights, colours = new Float32Array(xyz.length);
    for (let i = 0; i < xyz.length; i += 3) colours.set(heightColour((xyz[i + 2] - low) / (high - low)), i);
    return colours;
  };

  const start = () => {
    let renderer;
    try {
      renderer = new THREE.WebGLRenderer({antialias: true, preserveDrawingBuffer: true});
    } catch {
      return say('This browser shows no WebGL, which the 3-D view needs. Everything else on this page is complete.');
    }
    place.querySelector('.none').remove();
    renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    place.append(renderer.domElement);
    const scene = new THREE.Scene();
    const camera = new THREE.PerspectiveCamera(50, 1, 0.5, 20000);
    camera.up.set(0, 0, 1);
    const controls = new THREE.OrbitControls(camera, renderer.domElement);
    controls.maxPolarAngle = Math.PI / 2 - 0.02;
    controls.screenSpacePanning = false;

    const geometry = (xyz, colours) => {
      const g = new THREE.BufferGeometry();
      const add = (g.setAttribute || g.addAttribute).bind(g);
      add('position', new THREE.BufferAttribute(xyz, 3));
      if (colours) add('color', new THREE.BufferAttribute(colours, 3));
      return g;
    };
    const dots = (cloud, size, byHeight) => {
      const xyz = positions(cloud);
      const look = {size, sizeAttenuation: false};
      if (byHeight) look.vertexColors = THREE.VertexColors || true;
      return new THREE.Points(geometry(xyz, byHeight && heightColours(xyz)), new THREE.PointsMaterial(look));
    };
    const line = (cloud, parts, faint) => new (parts ? THREE.LineSegments : THREE.Line)(geometry(positions(cloud)), new THREE.LineBasicMaterial({transparent: true, opacity: faint || 1}));

    const map = dots(data.map, 1.3, false);
    map.material.transparent = true;
    scene.add(map);
    const routes = data.routes.map(route => line(route.reference, false));
    const configs = data.configs.map(config => {
      const all = {borders: line(config.borders, true, 0.35), runs: config.runs.flatMap(run => [line(run, false), dots(run, 4, false)])};
      if (config.specimen) {
        all.specimen = dots(config.specimen, 2, true);
        all.viewpoints = dots(config.viewpoints, 4, false);
        if (config.border) all.border = line(config.border, true);
      }
      return all;
    });
    const everything = all => [all.borders, all.specimen, all.viewpoints, all.border, ...all.runs].filter(Boolean);
    scene.add(...routes);
    configs.forEach(all => scene.add(...everything(all)));

    // Controls: what is seen, of which configuration, and from where.
    const panel = place.querySelector('.controls');
    const choice = document.createElement('select');
    data.configs.forEach((config, i) => choice.add(new Option(config.name, i)));
    choice.setAttribute('aria-label', 'configuration');
    const first = data.configs.findIndex(config => config.border);
    if (first >= 0) choice.value = first;
    panel.append(choice);
    const shown = {};
    for (const [key, words] of [['map', 'wide-area map'], ['specimen', 'region map'], ['viewpoints', 'viewpoints'], ['borders', 'region borders'],
      ['runs', 'estimated ways'], ['routes', 'reference']]) {
      const box = document.createElement('input'), label = document.createElement('label');
      box.type = 'checkbox';
      box.checked = true;
      label.append(box, words);
      panel.append(label);
      shown[key] = box;
    }
    const note = document.createElement('span');
    note.className = 'note';
    const ways = document.createElement('div');
    panel.append(note, ways);

    const draw = () => renderer.render(scene, camera);
    const paint = () => {
      const chosen = Number(choice.value);
      scene.background = new THREE.Color(css('--faint'));
      map.material.color = new THREE.Color(css('--soft'));
      map.material.opacity = 0.55;
      map.visible = shown.map.checked;
      routes.forEach(route => { route.material.color = new THREE.Color(css('--axis')); route.visible = shown.routes.checked; });
      configs.forEach((all, i) => {
        const colour = new THREE.Color(css('--c' + i % 8)), ink = new THREE.Color(css('--ink'));
        const see = (thing, yes, look) => { if (thing) { thing.visible = i === chosen && yes; if (look) thing.material.color = look; } };
        see(all.specimen, shown.specimen.checked);
        see(all.viewpoints, shown.viewpoints.checked, ink);
        see(all.border, shown.borders.checked, new THREE.Color('#d6336c'));
        see(all.borders, shown.borders.checked, new THREE.Color(css('--region')));
        all.runs.forEach(run => see(run, shown.runs.checked, colour));
      });
      const config = data.configs[chosen];
      note.textContent = config && config.specimen ? 'region ' + config.region : 'no points in this bundle';
      draw();
    };

    const centre = new THREE.Vector3(), spread = cloud => cloud.step.map(s => 65535 * s);
    const look = (dx, dy, dz) => {
      const config = data.configs[Number(choice.value)];
      let [target, size] = [data.map.count ? data.map : data.routes[0].reference, 0];
      if (config && config.border) target = config.border;
      const [w, h] = spread(target);
      size = config && config.border ? Math.max(90, 2.2 * Math.hypot(w, h)) : Math.max(40, 0.8 * Math.hypot(w, h));
      centre.set(target.origin[0] + w / 2, target.origin[1] + h / 2, target.origin[2]);
      controls.target.copy(centre);
      camera.position.set(centre.x + dx * size, centre.y + dy * size, centre.z + dz * size);
      controls.update();
      draw();
    };
    const buttons = document.createElement('div');
    for (const [words, ...from] of [['Oblique', 0.35, -0.85, 0.6], ['From above', 0, -0.001, 1.15]]) {
      const button = document.createElement('button');
      button.type = 'button';
      button.textContent = words;
      button.addEventListener('click', () => look(...from));
      buttons.append(button);
    }
    panel.append(buttons);

    const fit = () => {
      const width = place.clientWidth, height = place.clientHeight;
      renderer.setSize(width, height, false);
      camera.aspect = width / height;
      camera.updateProjectionMatrix();
      draw();
    };
    panel.addEventListener('change', event => { if (event.target === choice) look(0.35, -0.85, 0.6); paint(); });
    controls.addEventListener('change', draw);
    document.addEventListener('themechange', paint);
    new ResizeObserver(fit).observe(place);
    fit();
    look(0.35, -0.85, 0.6);
    paint();
  };
  // Only when it comes into sight: the rest of the page does not wait for it.
  const near = new IntersectionObserver(entries => {
    if (!entries.some(e => e.isIntersecting)) return;
    near.disconnect();
    start();
  }, {rootMargin: '400px'});
  near.observe(place);
})();
