'use strict';
const kStale = 2, kStrip = 60;  // s
const byId = id => document.getElementById(id);
const say = (id, text) => { byId(id).textContent = text; };
const seconds = () => performance.now() / 1000;

const view = new View(byId('view'));
const mostOfMap = view.isSlow ? 80000 : 400000, mostOfScan = view.isSlow ? 30000 : 150000;  // points that are drawn
if (!view.gl) notice('webgl', 'This browser shows no WebGL, which points are drawn with. All else is shown.');
let session = null, names = {}, roles = new Map(), ground = null, frames, robot, path, waiting, answers, arrivals, given, idle, follows = true;

const begin = () => {
  frames = new Frames();
  robot = null;          // {stamp, pose, covariance}
  path = [];
  waiting = null;        // the scan whose pose has not come yet
  answers = [];          // of the last minute: {at, risk, delay, state, points}
  arrivals = new Map();  // of scans, by stamp [ms]
  given = null;          // the pose that is being set, or was a moment ago
  idle = null;           // why no scan is localized
  ground = null;
  view.show('map', null);
  view.show('scan', null);
};
begin();

// What the server says once, by its id.
function notice(id, text) {
  const place = byId('notices'), old = [...place.children].find(one => one.dataset.id === id);
  const line = old || document.createElement('p');
  line.dataset.id = id;
  line.textContent = text;
  if (!old) place.append(line);
  while (place.children.length > 4) place.firstChild.remove();
}

// Clouds.
const count = n => n.toLocaleString('en-US');
const tellDrawn = () => {
  const words = ['map', 'scan'].flatMap(name => {
    const cloud = view.clouds.get(name);
    if (!cloud || cloud.hidden) return [];
    const n = cloud.xyz.length / 3;
    byId('drawn').dataset[name] = view.gl ? n : 0;
    return [name + ' ' + (n < cloud.total ? count(n) + ' of ' : '') + count(cloud.total) + ' points'];
  });
  if (names.map === '') words.unshift('this configuration publishes no map');
  say('drawn', words.join(', '));
};
const takeMap = cdr => {
  const cloud = readCloud(cdr, mostOfMap), {xyz, origin} = cloud, heights = new Float32Array(xyz.length / 3);
  ground = new Map();  // the lowest height in squares of 2 m
  for (let i = 0; i < xyz.length; i += 3) {
    const z = heights[i / 3] = xyz[i + 2] + origin[2];
    const square = squareOf(xyz[i] + origin[0], xyz[i + 1] + origin[1]);
    if (!(ground.get(square) <= z)) ground.set(square, z);
  }
  heights.sort();
  const low = heights[Math.floor(0.02 * heights.length)], high = heights[Math.floor(0.98 * heights.length)];
  view.show('map', {...cloud, pose: identity(), heights: [low, Math.max(low + 0.1, high)], tint: ['--faint', 0.45], size: [view.isSlow ? 0.2 : 0.12, 1.3, 4],
    hidden: !byId('show_map').checked});
  if (!robot && heights.length) view.camera.target = [...origin];
  tellDrawn();
};
const squareOf = (x, y) => Math.floor(x / 2) * 16777216 + Math.floor(y / 2);
const takeScan = (cdr, time) => {
  const cloud = readCloud(cdr, mostOfScan);
  arrivals.set(cloud.stamp, time);
  if (arrivals.size > 50) arrivals.delete(arrivals.keys().next().value);
  waiting = cloud;
};
// A scan comes before the pose that was found for it.
const placeScan = () => {
  if (!waiting) return;
  const T_base_sensor = frames.pose(names.base_frame, waiting.frame, -Infinity);
  const T_map_base = robot && robot.stamp === waiting.stamp ? robot.pose : frames.pose(names.map_frame, names.base_frame, waiting.stamp);
  if (!T_base_sensor || !T_map_base) return;
  view.show('scan', {...waiting, pose: compose(T_map_base, T_base_sensor), tint: ['--c1', 1], size: [0.14, 1.8, 4],
    hidden: !byId('show_scan').checked});
  waiting = null;
  tellDrawn();
};

// The robot.
const takePose = cdr => {
  robot = readPose(cdr);
  moveRobot();
};
const takeTransforms = (cdr, isStatic) => {
  const transforms = readTransforms(cdr);
  frames.add(transforms, isStatic);
  const stamp = Math.max(...transforms.map(one => one.stamp));
  const T_map_base = robot && stamp <= robot.stamp ? null : frames.pose(names.map_frame, names.base_frame, robot ? robot.stamp + 1e-6 : -Infinity);
  if (T_map_base) robot = {stamp: frames.links.get(names.base_frame).stamp, pose: T_map_base, covariance: null};
  moveRobot();
};
const moveRobot = () => {
  placeScan();
  if (!robot) return;
  const {t} = robot.pose, degrees = yawOf(robot.pose) * 180 / Math.PI;
  say('position', t.map(x => x.toFixed(2)).join(', ') + ' m');
  say('heading', degrees.toFixed(1) + '°');
  const C = robot.covariance;
  const shape = C && ellipseOf(C);
  say('within', shape ? shape.axes.map(a => (100 * a).toFixed(1)).join(' × ') + ' cm, ' + (1.96 * Math.sqrt(C[35]) * 180 / Math.PI).toFixed(2) + '°' : '–');
  if (!shape) say('enlarged', '');
  if (follows && !view.pointing) view.camera.target = [...t];
  view.changed();
};
// Half axes of the 95 % ellipse in the plane [m] and the direction of the first, from the rows of a covariance.
const ellipseOf = C => {
  const [a, b, c] = [C[0], (C[1] + C[6]) / 2, C[7]], middle = (a + c) / 2, half = Math.hypot((a - c) / 2, b);
  const axis = v => Math.sqrt(5.991 * Math.max(0, v));
  return {axes: [axis(middle + half), axis(middle - half)], turn: Math.atan2(2 * b, a - c) / 2};
};

// What was found for a scan.
const kTold = ['tracking', 'risk', 'region', 'outside', 'align_s', 'verdict_s', 'search_s', 'stall_s', 'scan_s', 'map_bytes', 'scan_points', 'scans_dropped'];
const takeRisk = cdr => {
  if (names.diagnostics !== '') return;  // which tell it, too
  const risk = cdr.f64();
  answer({risk, delay: null, state: 'unknown'});
  say('risk', risk.toPrecision(3));
  showState('unknown', 'this configuration publishes no diagnostics');
};
const answer = one => {
  answers.push({at: seconds(), ...one});
  while (answers[0].at < seconds() - kStrip) answers.shift();
  drawStrips();
  view.changed();
};
const takeDiagnostics = (cdr, time) => {
  const {stamp, status: [one]} = readDiagnostics(cdr);
  if (!one) return;
  const value = key => one.values.get(key), ms = key => (1000 * Number(value(key))).toFixed(1);
  say('dropped', value('scans_dropped') || '0');
  say('left_out', [...one.values].filter(([key, n]) => !kTold.includes(key) && n !== '0').map(([key, n]) => key.replaceAll('_', ' ') + ': ' + n).join('; '));
  idle = one.values.has('tracking') ? null : one.message;
  if (idle !== null) return showState('waits', idle);
  const state = value('tracking'), delay = arrivals.has(stamp) ? time - arrivals.get(stamp) : null;
  answer({risk: Number(value('risk')), delay, state});
  const why = one.message.startsWith(state + ': ') ? one.message.slice(state.length + 2) : '';
  showState(state, [why, value('outside') === 'yes' ? 'outside of all regions' : ''].filter(Boolean).join(', '));
  const age = robot ? stamp - robot.stamp : 0;
  say('known', age > 0.5 ? age.toFixed(0) + ' s old' : robot && !robot.covariance && state !== 'tracked' ? 'by odometry' : '');
  say('risk', value('risk'));
  say('region', value('region') || '–');
  if (delay !== null) say('delay', delay.toFixed(1) + ' ms');
  say('computing', ms('scan_s') + ' ms');
  say('steps', ['align', 'verdict', 'search', 'stall'].filter((key, i) => i < 2 || Number(value(key + '_s')) > 0).map(key => key + ' ' + ms(key + '_s')).join(', '));
  const now = seconds(), latest = answers.filter(({at}) => at > now - 5), span = now - latest[0].at;
  if (span > 0.5) say('rate', ((latest.length - 1) / span).toFixed(1) + ' a second');
  say('used', count(Number(value('scan_points'))) + ' points matched');
};
const showState = (state, why) => {
  document.body.dataset.state = state;
  byId('state').className = 'badge ' + state;
  say('state', state);
  say('reason', why);
};
// No answers for a while: what is shown is old.
setInterval(() => {
  const age = answers.length ? seconds() - answers[answers.length - 1].at : 0;
  document.querySelector('main').classList.toggle('stale', age > kStale);
  if (given && given.sent < seconds() - 3) given = null, view.changed();
  if (age > kStale && connection.is_open) showState('waits', idle ?? 'no scan was localized for ' + Math.round(age) + ' s');
  drawStrips();
}, 1000);

// Strips of the last minute, in the colour of the state.
const stateColours = {tracked: '--good', uncertain: '--warn', lost: '--bad'};
const strip = (id, share, marks) => {
  const canvas = byId(id), pen = canvas.getContext('2d'), scale = devicePixelRatio;
  const w = canvas.clientWidth, h = canvas.clientHeight, left = 48;
  Object.assign(canvas, {width: w * scale, height: h * scale});
  pen.scale(scale, scale);
  Object.assign(pen, {font: '11px system-ui, sans-serif', textAlign: 'right', textBaseline: 'middle', lineWidth: 1.5});
  const y = s => 7 + (h - 14) * (1 - Math.min(1, Math.max(0, s))), now = seconds();
  for (const [s, words] of marks) {
    pen.fillStyle = css('--soft');
    pen.fillText(words, left - 6, y(s));
    pen.fillStyle = css('--grid');
    pen.fillRect(left, y(s), w - left, 1);
  }
  const colourOf = Object.fromEntries(Object.entries(stateColours).map(([state, name]) => [state, css(name)])), soft = css('--soft');
  let last = null;
  for (const answer of answers) {
    const s = share(answer);
    const to = s === null ? null : [left + (w - left - 2) * (1 - (now - answer.at) / kStrip), y(s), answer.at];
    if (to && last && to[0] > left && to[2] - last[2] < kStale) {
      pen.strokeStyle = colourOf[answer.state] || soft;
      pen.beginPath();
      pen.moveTo(Math.max(left, last[0]), last[1]);
      pen.lineTo(to[0], to[1]);
      pen.stroke();
    }
    last = to;
  }
};
const drawStrips = () => {
  strip('risks', ({risk}) => (Math.log10(Math.max(risk, 1e-6)) + 6) / 6, [[1, '1'], [0.5, '0.001'], [0, '10⁻⁶']]);
  strip('delays', ({delay}) => delay === null ? null : Math.log10(Math.max(delay, 1)) / 3, [[1, '1 s'], [2 / 3, '100 ms'], [1 / 3, '10 ms'], [0, '1 ms']]);
};

// What is drawn over the points.
view.over = () => {
  const ink = css('--ink'), paper = css('--card');
  if (byId('show_path').checked) view.line(path.map(pose => pose.t), css('--c0'), 2);
  const state = document.body.dataset.state, isTracked = state === 'tracked';
  if (robot) {
    if (robot.covariance && isTracked) drawEllipse(robot);
    view.robot(robot.pose, isTracked ? css('--c0') : css(stateColours[state] || '--soft'), paper);
  }
  if (given) view.robot({t: given.t, q: [0, 0, Math.sin(given.yaw / 2), Math.cos(given.yaw / 2)]}, css('--c3'), paper);
  view.scaleBar(ink);
};
// As large as it is, or 10 or 100 times if it could not be seen.
const drawEllipse = ({pose, covariance}) => {
  const {axes, turn} = ellipseOf(covariance), pixels = axes[0] * view.camera.focus / view.camera.distance;
  const times = [1, 10, 100].find(n => n * pixels > 12) || 100;
  const ring = Array.from({length: 49}, (_, i) => {
    const [u, v] = [times * axes[0] * Math.cos(i * Math.PI / 24), times * axes[1] * Math.sin(i * Math.PI / 24)];
    return [pose.t[0] + u * Math.cos(turn) - v * Math.sin(turn), pose.t[1] + u * Math.sin(turn) + v * Math.cos(turn), pose.t[2]];
  });
  view.line(ring, css('--c3'), 2, css('--c3') + '30');
  say('enlarged', times > 1 ? 'drawn ' + times + ' times as large' : '');
};

// The server.
const rolesOf = names => new Map([[names.map, takeMap], [names.points, takeScan], [names.pose, takePose], [names.diagnostics, takeDiagnostics],
  [names.risk, takeRisk], [names.path, cdr => { path = readPath(cdr).poses; view.changed(); }], ['/tf', cdr => takeTransforms(cdr, false)],
  ['/tf_static', cdr => takeTransforms(cdr, true)]]);
const connection = new Connection(new URL('.', location).href.replace(/^http/, 'ws'), {
  info: text => {
    connection.is_open = true;
    byId('set').disabled = false;
    if (session !== text.sessionId) begin();
    session = text.sessionId;
    names = Object.fromEntries(Object.entries(text.metadata || {}).map(([key, name]) => [key.replace('vantage.', ''), name]));
    roles = rolesOf(names);
    say('node', text.name);
    byId('set').hidden = !(text.capabilities || []).includes('clientPublish');
    showState('waits', 'no scan was localized yet');
  },
  status: ({id, level, message}) => { if (level > 0) notice(id || message, message); },
  lost: () => {
    connection.is_open = false;
    byId('set').disabled = true;
    if (view.pointing || given) notice('pose', 'The connection was lost while a pose was set: it may not have arrived. Set it again.');
    given = null;
    point(false);
    showState('offline', 'no connection to ' + location.host + '; it is tried again every second');
  },
  message: (topic, cdr, time) => {
    try {
      roles.get(topic)(cdr, time);
    } catch (error) {
      notice(topic, 'a message of ' + topic + ' cannot be shown: ' + error.message);
    }
  },
}, topic => topic !== '' && roles.has(topic) && !(topic === names.points && (document.hidden || !byId('show_scan').checked)));

// Controls.
view.moved = () => follow(false);
const follow = yes => {
  follows = yes;
  byId('follow').setAttribute('aria-pressed', yes);
  if (yes && robot) view.camera.target = [...robot.pose.t];
  view.changed();
};
byId('follow').addEventListener('click', () => follow(!follows));
byId('above').addEventListener('click', () => {
  const isAbove = view.camera.down > 1.5;
  Object.assign(view.camera, {around: Math.PI / 2, down: isAbove ? 0.9 : Math.PI / 2});
  say('above', isAbove ? 'From above' : 'Oblique');
  view.changed();
});
document.addEventListener('change', () => {
  for (const name of ['map', 'scan']) if (view.clouds.has(name)) view.clouds.get(name).hidden = !byId('show_' + name).checked;
  connection.subscribe();
  tellDrawn();
  view.changed();
});
document.addEventListener('visibilitychange', () => connection.subscribe());
document.addEventListener('themechange', () => { view.changed(); drawStrips(); });

// Sets a pose: press where the robot is, drag to where it faces.
const kHint = 'Press where the robot is, and drag in the direction that it faces. Esc ends this.';
const point = yes => {
  byId('set').setAttribute('aria-pressed', yes);
  byId('view').classList.toggle('pointing', yes);
  byId('hint').hidden = !yes;
  say('hint', kHint);
  view.pointing = yes ? pointing : null;
};
const groundAt = (x, y) => {
  let z = robot ? robot.pose.t[2] : view.camera.target[2], p = null;
  for (let i = 0; i < 4; ++i) {
    p = view.camera.ground(x, y, z);
    if (!p) return null;
    z = ground && ground.get(squareOf(p[0], p[1])) !== undefined ? ground.get(squareOf(p[0], p[1])) : z;
  }
  return p;
};
const pointing = (phase, x, y) => {
  if (phase === 'off') given = null;
  if (phase === 'down') {
    const t = groundAt(x, y);
    given = t && {t, yaw: 0, from: [x, y], far: false};
  }
  if (given && given.from) {
    const to = view.camera.ground(x, y, given.t[2]);
    given.far = Math.hypot(x - given.from[0], y - given.from[1]) > 12;
    if (to && given.far) given.yaw = Math.atan2(to[1] - given.t[1], to[0] - given.t[0]);
    if (phase === 'up' && given.far) return publishGiven();
    if (phase === 'up') given = null, say('hint', 'Drag further, to say where the robot faces. Esc ends this.');
  }
  view.changed();
};
const publishGiven = () => {
  const [x, y, z] = given.t, now = Date.now(), covariance = Array(36).fill(0);
  covariance[0] = covariance[7] = 0.25;          // 0.5 m
  covariance[35] = (15 * Math.PI / 180) ** 2;
  connection.publish(names.initial_pose, 'geometry_msgs/PoseWithCovarianceStamped', {
    header: {stamp: {sec: Math.floor(now / 1000), nanosec: now % 1000 * 1e6}, frame_id: names.map_frame},
    pose: {pose: {position: {x, y, z}, orientation: {x: 0, y: 0, z: Math.sin(given.yaw / 2), w: Math.cos(given.yaw / 2)}}, covariance},
  });
  given = {t: given.t, yaw: given.yaw, sent: seconds()};
  point(false);
  view.changed();
};
byId('set').addEventListener('click', () => point(!view.pointing));
addEventListener('keydown', event => {
  if (event.key !== 'Escape' || !view.pointing) return;
  given = null;
  point(false);
  view.changed();
});
