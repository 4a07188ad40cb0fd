// Connects to `vantage live` with Foxglove's own client, decodes every message by the schema text
// that the server sends, and says what came:
//   VANTAGE_NODE_MODULES=.../node_modules node read_foxglove.mjs URL SUBPROTOCOL SECONDS [POSE]
// POSE (x,y,yaw) is published on /initialpose after the first pose came, as Foxglove's 3-D panel
// does it. Prints one JSON object.
import { createRequire } from "node:module";
import { join } from "node:path";

const require = createRequire(join(process.env.VANTAGE_NODE_MODULES, "any.js"));
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader, MessageWriter } = require("@foxglove/rosmsg2-serialization");
const { WebSocket } = require("ws");

const [url, subprotocol, seconds, pose] = process.argv.slice(2);
const socket = new WebSocket(url, [subprotocol]);
const client = new FoxgloveClient({ ws: socket });
const found = { protocol: null, serverInfo: null, statuses: [], topics: {}, published: null };
const readers = new Map();

function publish() {
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
  const [x, y, yaw] = pose.split(",").map(Number);
  const covariance = new Float64Array(36);
  covariance[0] = covariance[7] = 0.25;
  covariance[35] = 0.0685;
  const message = {
    header: { stamp: { sec: Math.floor(Date.now() / 1000), nanosec: 0 }, frame_id: "map" },
    pose: {
      pose: {
        position: { x, y, z: 0 },
        orientation: { x: 0, y: 0, z: Math.sin(yaw / 2), w: Math.cos(yaw / 2) },
      },
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
  if (pose && topic === "/amcl_pose" && found.published == null) publish();
});

const short = (key, value) => {
  if (typeof value === "bigint") return value.toString();
  if (value instanceof Uint8Array) return `${value.length} bytes`;
  if (value instanceof Float64Array) return Array.from(value);
  if (key === "poses") return `${value.length} poses`;
  return value;
};
setTimeout(() => {
  console.log(JSON.stringify(found, short, 1));
  process.exit(0);
}, Number(seconds) * 1000);
