// Reads an MCAP file with the format's own reader, decoding every message by the schema text that
// the file holds. Run by itself it prints what is in the file:
//   VANTAGE_NODE_MODULES=.../node_modules node read_mcap.mjs FILE
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

const require = createRequire(join(process.env.VANTAGE_NODE_MODULES, "any.js"));
const { McapIndexedReader, McapStreamReader } = require("@mcap/core");
const { loadDecompressHandlers } = require("@mcap/support");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");

class Bytes {
  constructor(bytes) {
    this.bytes = bytes;
  }
  async size() {
    return BigInt(this.bytes.length);
  }
  async read(offset, size) {
    const end = Number(offset) + Number(size);
    if (end > this.bytes.length) throw new Error(`read up to ${end} of ${this.bytes.length} bytes`);
    return new Uint8Array(this.bytes.subarray(Number(offset), end));
  }
}

// By the index: { header, metadata, statistics, topics: topic -> { schema, messages } }.
export async function read(file) {
  const bytes = await readFile(file);
  const decompressHandlers = await loadDecompressHandlers();
  const reader = await McapIndexedReader.Initialize({ readable: new Bytes(bytes), decompressHandlers });
  const topics = {};
  const decoders = {};
  for (const channel of reader.channelsById.values()) {
    const schema = reader.schemasById.get(channel.schemaId);
    const text = new TextDecoder().decode(schema.data);
    decoders[channel.topic] = new MessageReader(parse(text, { ros2: true }));
    topics[channel.topic] = {
      schema: schema.name,
      encodings: [schema.encoding, channel.messageEncoding],
      messages: [],
    };
  }
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    const { topic } = reader.channelsById.get(message.channelId);
    topics[topic].messages.push({
      logTime: message.logTime,
      sequence: message.sequence,
      value: decoders[topic].readMessage(message.data),
    });
  }
  const metadata = {};
  for await (const record of reader.readMetadata()) {
    metadata[record.name] = Object.fromEntries(record.metadata);
  }
  return {
    header: reader.header,
    metadata,
    statistics: reader.statistics,
    chunks: reader.chunkIndexes,
    topics,
    streamed: countStreamed(bytes, decompressHandlers),
  };
}

// From the first byte to the last, without the index; every checksum is compared.
function countStreamed(bytes, decompressHandlers) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  reader.append(bytes);
  const counts = {};
  for (let record; (record = reader.nextRecord()); ) {
    counts[record.type] = (counts[record.type] ?? 0) + 1;
  }
  if (!reader.done()) throw new Error("the file does not end where it should");
  return counts;
}

export function pointsOf(cloud) {
  const view = new DataView(cloud.data.buffer, cloud.data.byteOffset, cloud.data.byteLength);
  const points = [];
  for (let at = 0; at < cloud.data.byteLength; at += cloud.point_step) {
    points.push(cloud.fields.map((field) => view.getFloat32(at + field.offset, true)));
  }
  return points;
}

export const nanoseconds = ({ sec, nsec, nanosec }) =>
  BigInt(sec) * 1_000_000_000n + BigInt(nsec ?? nanosec);

function describe({ header, metadata, statistics, topics }) {
  const short = (key, value) => {
    if (typeof value === "bigint") return value.toString();
    if (value instanceof Uint8Array) return `${value.length} bytes`;
    if (value instanceof Map) return Object.fromEntries(value);
    return value;
  };
  const ends = Object.entries(topics).map(([topic, { schema, messages }]) => [
    topic,
    { schema, count: messages.length, first: messages[0], last: messages.at(-1) },
  ]);
  const all = { header, metadata, statistics, topics: Object.fromEntries(ends) };
  return JSON.stringify(all, short, 2);
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  console.log(describe(await read(process.argv[2])));
}
