// Checks the files of `mcap_samples messages FOLDER` against the formulas in samples.cpp:
//   VANTAGE_NODE_MODULES=.../node_modules node check_samples.mjs FOLDER
import assert from "node:assert/strict";
import { join } from "node:path";
import { nanoseconds, pointsOf, read } from "./read_mcap.mjs";

const kCount = 60;
const folder = process.argv[2];
for (const compression of ["none", "lz4", "zstd"]) {
  const { header, statistics, chunks, topics } = await read(join(folder, `${compression}.mcap`));
  assert.equal(header.profile, "ros2");
  assert.equal(statistics.messageCount, BigInt(5 * kCount));
  assert.ok(chunks.length > 1);
  for (const chunk of chunks) {
    assert.equal(chunk.compression, compression === "none" ? "" : compression);
    if (compression !== "none") assert.ok(chunk.compressedSize < chunk.uncompressedSize);
  }
  assert.equal(Object.keys(topics).length, 5);
  for (const { messages } of Object.values(topics)) assert.equal(messages.length, kCount);

  for (let i = 0; i < kCount; ++i) {
    const at = (topic) => topics[topic].messages[i].value;
    const stamp = BigInt(i) * 100_000_000n;
    for (const { messages } of Object.values(topics)) assert.equal(messages[i].logTime, stamp);

    const cloud = at("/cloud");
    assert.equal(nanoseconds(cloud.header.stamp), stamp);
    assert.equal(cloud.header.frame_id, "map");
    assert.deepEqual(cloud.fields.map(({ name }) => name), ["x", "y", "z", "time"]);
    assert.equal(cloud.width, 10_000 * (i % 3));
    assert.equal(cloud.row_step, cloud.data.byteLength);
    assert.equal(cloud.is_bigendian, false);
    assert.equal(cloud.is_dense, true);
    pointsOf(cloud).forEach((point, k) => assert.deepEqual(point, [k, -0.5 * k, i, 0.25 * k]));

    const position = { x: i, y: 2, z: -3 };
    const turn = { x: 0.5, y: -0.5, z: 0.5, w: 0.5 };
    assert.equal(nanoseconds(at("/pose").header.stamp), stamp);
    assert.deepEqual({ ...at("/pose").pose.position }, position);
    assert.deepEqual({ ...at("/pose").pose.orientation }, turn);

    const text = "n".repeat(i % 9);
    assert.equal(at("/text").data, text);

    assert.equal(at("/tf").transforms.length, i % 3);
    for (const { header, child_frame_id, transform } of at("/tf").transforms) {
      assert.equal(nanoseconds(header.stamp), stamp);
      assert.equal(header.frame_id, "map");
      assert.equal(child_frame_id, "lidar");
      assert.deepEqual({ ...transform.translation }, position);
      assert.deepEqual({ ...transform.rotation }, turn);
    }

    const [status] = at("/diagnostics").status;
    assert.equal(at("/diagnostics").status.length, 1);
    assert.equal(status.level, 1);
    assert.deepEqual([status.name, status.message, status.hardware_id], ["name", text, ""]);
    assert.deepEqual(status.values.map(({ key, value }) => [key, value]), [["key", text], ["other", "value"]]);
  }
  console.log(`${compression}.mcap: ${statistics.messageCount} messages in ${chunks.length} chunks as they were written`);
}
