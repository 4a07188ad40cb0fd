// Compares the recording of a run with the run's own files:
//   VANTAGE_NODE_MODULES=.../node_modules node check_run.mjs RUN.mcap RUN_FOLDER SCANS MAPS SHIFT LEVELS
// SCANS: folder of the scans; MAPS: whether /map is there; SHIFT: "x,y,z", the origin [m];
// LEVELS: those of diagnostics that must be there: "0", "1" and "2" for OK, WARN and ERROR.
import assert from "node:assert/strict";
import { readdir, readFile } from "node:fs/promises";
import { join } from "node:path";
import { nanoseconds, pointsOf, read } from "./read_mcap.mjs";

const [file, folder, scans, maps, shift, levels] = process.argv.slice(2);
const origin = shift.split(",").map(Number);
const near = (a, b, tolerance, what) =>
  assert.ok(Math.abs(a - b) <= tolerance, `${what}: ${a} is not ${b} within ${tolerance}`);
const stampOf = (text) => {
  const [whole, rest] = text.split(".");
  return BigInt(whole) * 1_000_000_000n + BigInt((rest ?? "").padEnd(9, "0"));
};
const lines = async (path) => (await readFile(path, "utf8")).trimEnd().split("\n");

const [names, ...cells] = (await lines(join(folder, "scans.csv"))).map((line) => line.split(","));
const rows = cells.map((row) => Object.fromEntries(names.map((name, i) => [name, row[i]])));
const tum = (await lines(join(folder, "trajectory.tum")))
  .filter((line) => !line.startsWith("#"))
  .map((line) => line.split(" "));
const run = await read(file);

assert.deepEqual(run.header.profile, "ros2");
const schemas = {
  "/scan": "sensor_msgs/msg/PointCloud2",
  "/pose": "geometry_msgs/msg/PoseStamped",
  "/pose_with_covariance": "geometry_msgs/msg/PoseWithCovarianceStamped",
  "/region": "std_msgs/msg/String",
  "/tf": "tf2_msgs/msg/TFMessage",
  "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
};
if (maps === "yes") schemas["/map"] = "sensor_msgs/msg/PointCloud2";
assert.deepEqual(Object.keys(run.topics).sort(), Object.keys(schemas).sort());
for (const [topic, { schema, encodings, messages }] of Object.entries(run.topics)) {
  assert.equal(schema, schemas[topic]);
  assert.deepEqual(encodings, ["ros2msg", "cdr"]);
  messages.forEach((message, i) => assert.equal(message.sequence, i));
}
const messagesOf = (topic) => run.topics[topic].messages;
const all = Object.values(run.topics).reduce((sum, { messages }) => sum + messages.length, 0);
assert.equal(run.statistics.messageCount, BigInt(all));
// Those in chunks come out of the stream reader too.
assert.equal(run.streamed.Message, all);
["x", "y", "z"].forEach((axis, i) =>
  assert.equal(Number(run.metadata.vantage[`origin_${axis}`]), origin[i]),
);

const placed = rows.filter((row) => row.x !== "");
assert.equal(messagesOf("/scan").length, rows.length);
assert.equal(messagesOf("/diagnostics").length, rows.length);
for (const topic of ["/pose", "/pose_with_covariance", "/tf", "/region"]) {
  assert.equal(messagesOf(topic).length, placed.length, topic);
}

messagesOf("/pose_with_covariance").forEach(({ value: message }, i) => {
  assert.deepEqual(message.pose.pose, messagesOf("/pose")[i].value.pose);
  const sigma = Math.sqrt(Math.max(...[0, 7, 14].map((k) => message.pose.covariance[k])));
  const row = placed[i];
  if (row.tracking === "tracked") assert.ok(sigma <= Number(row.sigma_m) * 1.001);
});
placed.forEach((row, i) => {
  const [pose, tf, region] = ["/pose", "/tf", "/region"].map((topic) => messagesOf(topic)[i]);
  const stamp = stampOf(row.stamp);
  for (const message of [pose, tf, region]) assert.equal(message.logTime, stamp);
  assert.equal(nanoseconds(pose.value.header.stamp), stamp);
  assert.equal(pose.value.header.frame_id, "map");
  const [transform] = tf.value.transforms;
  assert.equal(tf.value.transforms.length, 1);
  assert.equal(transform.header.frame_id, "map");
  assert.equal(transform.child_frame_id, "lidar");
  const { position, orientation } = pose.value.pose;
  ["x", "y", "z"].forEach((axis, k) => {
    near(position[axis] + origin[k], Number(row[axis]), 1e-8, `${row.stamp} ${axis}`);
    assert.equal(transform.transform.translation[axis], position[axis]);
  });
  for (const axis of ["x", "y", "z", "w"]) {
    near(orientation[axis], Number(row[`q${axis}`]), 1e-12, `${row.stamp} q${axis}`);
    assert.equal(transform.transform.rotation[axis], orientation[axis]);
  }
  assert.equal(region.value.data, row.region);
});

// The trajectory holds the tracked poses.
const tracked = rows.filter((row) => row.tracking === "tracked");
assert.equal(tum.length, tracked.length);
assert.ok(tum.length > 0);
for (const line of tum) {
  const [stamp, ...numbers] = line.map(Number);
  const pose = messagesOf("/pose").find(({ logTime }) => Math.abs(Number(logTime) / 1e9 - stamp) < 1e-6);
  const { position, orientation } = pose.value.pose;
  [position.x, position.y, position.z].forEach((x, k) => near(x + origin[k], numbers[k], 1e-6, line));
  const { x, y, z, w } = orientation;
  [x, y, z, w].forEach((q, k) => near(q, numbers[3 + k], 1e-6, line));
}

const seenLevels = new Set();
rows.forEach((row, i) => {
  const { logTime, value } = messagesOf("/diagnostics")[i];
  assert.equal(logTime, stampOf(row.stamp));
  const [status] = value.status;
  const level = ["tracked", "uncertain", "lost"].indexOf(row.tracking);
  assert.equal(status.level, level);
  seenLevels.add(level);
  const [state, ...reason] = status.message.split(": ");
  assert.equal(state, row.tracking);
  if (level === 2) assert.ok(reason.length > 0, "a lost scan has a reason");
  assert.ok(row.reason.startsWith(`"${reason.join(": ").split(/[",]/)[0]}`), status.message);
  const values = Object.fromEntries(status.values.map(({ key, value }) => [key, value]));
  assert.equal(values.tracking, row.tracking);
  for (const [name, column] of [["align_ms", "align_ms"], ["stall_ms", "stall_ms"],
    ["fitness", "fitness"], ["nvtl", "nvtl"], ["coverage", "coverage"], ["sigma_m", "sigma_m"],
    ["risk", "risk"], ["error_m", "error_m"], ["error_deg", "error_deg"]]) {
    if (row[column] === "") assert.equal(values[name], undefined, name);
    else near(Number(values[name]), Number(row[column]), 1e-4, `${row.stamp} ${name}`);
  }
});

for (const level of levels) assert.ok(seenLevels.has(Number(level)), `level ${level} is missing`);

// The layout beside the recording: every plotted path leads to numbers.
const layout = JSON.parse(await readFile(file.replace(/\.mcap$/, ".foxglove.json"), "utf8"));
const view = layout.configById["3D!view"];
for (const topic of Object.keys(view.topics)) assert.ok(schemas[topic], topic);
assert.equal(view.followTf, messagesOf("/tf")[0].value.transforms[0].child_frame_id);
const plots = Object.entries(layout.configById).filter(([panel]) => panel.startsWith("Plot!"));
assert.equal(plots.length, 3);
for (const { value } of plots.flatMap(([, plot]) => plot.paths)) {
  const [, topic, key] = /^(\/\w+)\.status\[0\]\.values\[:\]\{key=="(\w+)"\}\.value$/.exec(value);
  const found = messagesOf(topic).flatMap((message) =>
    message.value.status[0].values.filter((one) => one.key === key).map((one) => +one.value));
  assert.ok(found.every(Number.isFinite), value);
  assert.ok(found.length > 0 || key === "search_ms", value);
}

// ASCII and binary PCD say how many points they have in their head.
const files = (await readdir(scans)).filter((name) => name.endsWith(".pcd")).sort();
assert.equal(files.length, rows.length);
for (let i = 0; i < files.length; ++i) {
  const head = (await readFile(join(scans, files[i]))).subarray(0, 500).toString("latin1");
  const { logTime, value } = messagesOf("/scan")[i];
  assert.equal(logTime, stampOf(rows[i].stamp));
  assert.equal(value.header.frame_id, "lidar");
  assert.equal(value.width * value.height, Number(/^POINTS (\d+)/m.exec(head)[1]));
  assert.equal(pointsOf(value).length, value.width);
}

if (maps === "yes") {
  let before;
  const switches = placed.filter(({ region }) => {
    const switched = region !== before;
    before = region;
    return switched;
  });
  assert.ok(switches.length > 1, "the run is to have a switch");
  assert.deepEqual(messagesOf("/map").map(({ logTime }) => logTime), switches.map(({ stamp }) => stampOf(stamp)));
  messagesOf("/map").forEach(({ value }, i) => {
    assert.equal(value.header.frame_id, "map");
    assert.equal(value.width, Number(switches[i].map_points), "points of the region map");
    // The sensor is in the middle of what it sees.
    const distances = pointsOf(value).map(([x, y]) =>
      Math.hypot(x + origin[0] - switches[i].x, y + origin[1] - switches[i].y));
    assert.ok(Math.min(...distances.slice(0, 50_000)) < 100);
  });
}
console.log(`${file}: ${all} messages of ${rows.length} scans, ` +
  `${run.statistics.chunkCount} chunks (${run.chunks[0].compression}), as the run's files say`);
