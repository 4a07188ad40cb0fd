// Connects to `vantage live` with Foxglove's own client, decodes every message by the schema text
// that the server sends, and prints what came when the server ends, as one JSON object:
//   VANTAGE_NODE_MODULES=.../node_modules node read_foxglove.mjs URL SUBPROTOCOL [publish]
// With `publish` it gives the first pose that it gets back on /initialpose, encoded as Foxglove's
// 3-D panel does it. Exit code 1 if a map, a pose, diagnostics and so on were not among it.
import { createRequire } from "node:module";
import { join } from "node:path";

const require = createRequire(join(process.env.VANTAGE_NODE_MODULES, "any.js"));
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader, MessageWriter } = require("@foxglove/rosmsg2-serialization");
const { WebSocket } = require("ws");

const [url, subprotocol, publishes] = process.argv.slice(2);
const socket = new WebSocket(url, [subprotocol]);
const client = new FoxgloveClient({ ws: socket });
const found = { protocol: null, serverInfo: null, statuses: [], topics: {}, published: null };
const readers = new Map();

function publish({ position, orientation }) {
  const schema = `std_msgs/Header header
geometry_msgs/PoseWithCovariance pose
===
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
===
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
===
MSG: geometry_msgs/PoseWithCovariance
geometry_msgs/Pose pose
float64[36] covariance
===
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
===
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
===
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
`;
  const covariance = new Float64Array(36);
  covariance[0] = covariance[7] = 0.25;
  covariance[35] = 0.0685;
  const message = {
    header: { stamp: { sec: Math.floor(Date.now() / 1000), nanosec: 0 }, frame_id: "map" },
    pose: {
      pose: { position, orientation },
      covariance,
    },
  };
  const encoding = found.serverInfo.supportedEncodings.find((one) => ["json", "cdr"].includes(one));
  const channel = client.advertise({
    topic: "/initialpose",
    encoding,
    schemaName: "geometry_msgs/PoseWithCovarianceStamped",
  });
  client.sendMessage(
    channel,
    encoding === "cdr"
      ? new MessageWriter(parse(schema, { ros2: true })).writeMessage(message)
      : new TextEncoder().encode(JSON.stringify(message)),
  );
  found.published = encoding;
}

client.on("open", () => (found.protocol = socket.protocol));
client.on("serverInfo", (info) => (found.serverInfo = info));
client.on("status", ({ level, message }) => found.statuses.push({ level, message }));
client.on("error", (error) => {
  console.error(String(error.message ?? error));
  process.exit(1);
});
client.on("advertise", (channels) => {
  for (const channel of channels) {
    const reader = new MessageReader(parse(channel.schema, { ros2: true }));
    readers.set(client.subscribe(channel.id), { topic: channel.topic, reader });
    found.topics[channel.topic] = { schema: channel.schemaName, messages: 0, last: null };
  }
});
client.on("message", ({ subscriptionId, timestamp, data }) => {
  const { topic, reader } = readers.get(subscriptionId);
  const entry = found.topics[topic];
  entry.messages += 1;
  entry.time = timestamp;
  entry.last = reader.readMessage(data);
  if (publishes && topic === "/amcl_pose" && found.published == null) publish(entry.last.pose.pose);
});

const short = (key, value) => {
  if (typeof value === "bigint") return value.toString();
  if (value instanceof Uint8Array) return `${value.length} bytes`;
  if (value instanceof Float64Array) return Array.from(value);
  if (key === "poses") return `${value.length} poses`;
  return value;
};
client.on("close", () => {
  console.log(JSON.stringify(found, short, 1));
  const wrong = [];
  const check = (what, holds) => holds || wrong.push(what);
  const last = (topic) => found.topics[topic]?.last;
  const near = (a, b) => Math.hypot(a.x - b.x, a.y - b.y, a.z - b.z) < 100;
  check("subprotocol", found.protocol === subprotocol);
  check("map", last("/map")?.data.length === last("/map")?.width * last("/map")?.point_step);
  check("points", last("/points")?.width > 0);
  check("pose", last("/amcl_pose")?.header.frame_id === "map");
  check("covariance", last("/amcl_pose")?.pose.covariance[0] > 0);
  check("tf", found.topics["/tf"]?.messages > 0);
  const status = last("/diagnostics")?.status[0];
  check("diagnostics", status?.values.some(({ key, value }) => key === "risk" && value !== ""));
  check("risk", last("/vantage/risk")?.data >= 0);
  const path = last("/vantage/path")?.poses ?? [];
  check("path", path.length > 0 && near(path[0].pose.position, last("/amcl_pose").pose.pose.position));
  check("statuses", found.statuses.every(({ level }) => level < 2));
  check("published", !publishes || found.published != null);
  if (wrong.length > 0) console.error(`not as expected: ${wrong.join(", ")}`);
  process.exit(wrong.length > 0 ? 1 : 0);
});
