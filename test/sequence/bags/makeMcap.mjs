// node makeMcap.mjs MESSAGES.json OUT.mcap none|lz4|zstd|unchunked
// With npm's @mcap/core, @foxglove/rosmsg2-serialization and @foxglove/rosmsg-msgs-common (and Debian's zstd, lz4);
// MESSAGES.json is what messages.py tells.
import { execFileSync } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";
import { McapWriter } from "@mcap/core";
import rosmsg2 from "@foxglove/rosmsg2-serialization";
import common from "@foxglove/rosmsg-msgs-common";

const [, , source, out, packing] = process.argv;
const drive = JSON.parse(readFileSync(source, "utf8"));

// The definition of a type and of all that it has.
function definitionsOf(type, found = new Map()) {
  if (found.has(type)) return found;
  const definition = common.ros2humble[type];
  found.set(type, definition);
  for (const field of definition.definitions) if (field.isComplex) definitionsOf(field.type, found);
  return found;
}

class Sink {
  chunks = [];
  size = 0n;
  position() { return this.size; }
  async write(bytes) { this.chunks.push(Buffer.from(bytes)); this.size += BigInt(bytes.byteLength); }
}

const sink = new Sink();
const tools = { lz4: ["lz4", ["-z", "-c", "--no-frame-crc"]], zstd: ["zstd", ["-c", "-q"]] };
const writer = new McapWriter({
  writable: sink,
  useChunks: packing !== "unchunked",
  chunkSize: 60000,
  compressChunk: tools[packing] && ((bytes) => {
    const [tool, options] = tools[packing];
    return { compression: packing, compressedData: execFileSync(tool, options, { input: bytes }) };
  }),
});
await writer.start({ profile: "ros2", library: "makeMcap" });
const channels = new Map();
async function write(topic, type, ns, message) {
  if (!channels.has(topic)) {
    const definitions = definitionsOf(type);
    const schemaId = await writer.registerSchema({
      name: type.replace("/", "/msg/"), encoding: "ros2msg", data: new TextEncoder().encode(`# ${type}`),
    });
    const id = await writer.registerChannel({ schemaId, topic, messageEncoding: "cdr", metadata: new Map() });
    channels.set(topic, { id, writer: new rosmsg2.MessageWriter([...definitions.values()]) });
  }
  const channel = channels.get(topic);
  const time = BigInt(ns) + BigInt(drive.received_later);
  await writer.addMessage({ channelId: channel.id, sequence: 0, logTime: time, publishTime: time,
                            data: channel.writer.writeMessage(message) });
}
const header = (ns, frame_id) => ({ stamp: { sec: Number(BigInt(ns) / 1000000000n), nanosec: Number(BigInt(ns) % 1000000000n) }, frame_id });
const xyz = ([x, y, z]) => ({ x, y, z });
for (const m of drive.messages) {
  if (m.topic === "/tf_static") {
    await write(m.topic, "tf2_msgs/TFMessage", m.ns, { transforms: m.frames.map(([parent, child, p, [x, y, z, w]]) =>
      ({ header: header(m.ns, parent), child_frame_id: child, transform: { translation: xyz(p), rotation: { x, y, z, w } } })) });
  } else if (m.topic === "/odom") {
    await write(m.topic, "nav_msgs/Odometry", m.ns, { header: header(m.ns, "odom"), child_frame_id: "base_link",
      pose: { pose: { position: xyz([0, 0, 0]), orientation: { x: 0, y: 0, z: 0, w: 1 } }, covariance: Array(36).fill(0) },
      twist: { twist: { linear: xyz(m.v), angular: xyz(m.w) }, covariance: Array(36).fill(0) } });
  } else if (m.topic === "/camera/image_raw") {
    await write(m.topic, "sensor_msgs/Image", m.ns, { header: header(m.ns, "camera_optical"), height: m.height, width: m.width,
      encoding: "mono8", is_bigendian: 0, step: m.width, data: new Uint8Array(Buffer.from(m.levels, "base64")) });
  } else {
    await write(m.topic, "sensor_msgs/CameraInfo", m.ns, { header: header(m.ns, "camera_optical"), height: m.height, width: m.width,
      distortion_model: "plumb_bob", d: [0, 0, 0, 0, 0], k: m.K, r: Array(9).fill(0), p: Array(12).fill(0),
      binning_x: 0, binning_y: 0, roi: { x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: false } });
  }
}
await writer.end();
writeFileSync(out, Buffer.concat(sink.chunks));
