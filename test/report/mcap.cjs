// MCAP files of run and replay, read by others' code: the reader of MCAP's own project, with all CRCs, and a
// validator of JSON schemas; the values of every topic against the run folder, the images against the recording.
//   node mcap.cjs TOOL DATA NODE_MODULES
// Exit code 77: @mcap/core, ajv or fzstd is not there (npm install --prefix DIR @mcap/core ajv fzstd).

const { execFileSync } = require("child_process");
const fs = require("fs"), os = require("os"), path = require("path"), assert = require("assert"), zlib = require("zlib");
const [tool, data, modules] = process.argv.slice(2);

function need(name) {
  try {
    return require(require.resolve(name, { paths: [modules, path.dirname(modules)] }));
  } catch (error) {
    console.log(`skipped: ${name} is not in ${modules}; npm install --prefix ${path.dirname(modules)} ` +
                "@mcap/core@2 ajv@8 fzstd@0.1");
    process.exit(77);
  }
}
const { McapIndexedReader, McapStreamReader } = need("@mcap/core");
const Ajv = need("ajv"), fzstd = need("fzstd");

const decompressHandlers = { zstd: (bytes, size) => fzstd.decompress(bytes, new Uint8Array(Number(size))) };
const folder = fs.mkdtempSync(path.join(os.tmpdir(), "depthservo-mcap-"));
process.on("exit", () => fs.rmSync(folder, { recursive: true, force: true }));
const run = (...args) => execFileSync(tool, args, { stdio: ["ignore", "pipe", "ignore"] });
const at = (name) => path.join(folder, name);

/// Every message, by topic, in the order of the file; each valid by the schema in the file, which is that of
/// data/foxglove.
function readWhole(file) {
  const reader = new McapStreamReader({ validateCrcs: true, decompressHandlers });
  const ajv = new Ajv({ strict: false });
  const schemas = new Map(), channels = new Map(), topics = {};
  reader.append(fs.readFileSync(file));
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Schema" && !schemas.has(record.id)) {
      const text = new TextDecoder().decode(record.data);
      const name = record.name.split(".")[1];
      assert.strictEqual(text, fs.readFileSync(path.join(data, "foxglove", name + ".json"), "utf8"));
      schemas.set(record.id, ajv.compile(JSON.parse(text)));
    } else if (record.type === "Channel") {
      channels.set(record.id, record);
    } else if (record.type === "Message") {
      const channel = channels.get(record.channelId), isValid = schemas.get(channel.schemaId);
      const value = JSON.parse(new TextDecoder().decode(record.data));
      assert(isValid(value), `${channel.topic}: ${JSON.stringify(isValid.errors)}`);
      (topics[channel.topic] ||= []).push({ time: record.logTime, value });
    }
  }
  assert(reader.done(), "the file is not read to its end");
  return topics;
}

async function readBySeeking(file) {
  const handle = await fs.promises.open(file);
  const readable = {
    size: async () => BigInt((await handle.stat()).size),
    read: async (offset, size) => {
      const bytes = new Uint8Array(Number(size));
      await handle.read(bytes, 0, bytes.length, Number(offset));
      return bytes;
    },
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  let messages = 0, last = 0n;
  for await (const message of reader.readMessages()) {
    assert(message.logTime >= last, "in order of time");
    last = message.logTime;
    ++messages;
  }
  assert.strictEqual(BigInt(messages), reader.statistics.messageCount);
  for await (const metadata of reader.readMetadata()) assert.strictEqual(metadata.name, "depthservo");
  await handle.close();
  return messages;
}

function csv(file) {
  const [head, ...rows] = fs.readFileSync(file, "utf8").trim().split("\n").map((line) => line.split(","));
  return rows.map((row) => Object.fromEntries(head.map((name, i) => [name, row[i]])));
}

/// Equal but for the rounding of a text with so many decimals.
const near = (a, b, what, within = 1e-9) =>
  assert(Math.abs(a - b) <= within * Math.max(1, Math.abs(b)), `${what}: ${a}, expected ${b}`);
const numberIn = (cell) => (cell === "" ? undefined : Number(cell));
const nanoseconds = (time) => BigInt(time.sec) * 1000000000n + BigInt(time.nsec);
const timeOf = (row) => BigInt(Math.round(Number(row.timestamp) * 1e9));

/// Gray levels of a PNG, 8 bit, by the standard (https://www.w3.org/TR/png), with no code of ours.
function grayOf(png) {
  let width, height, packed = [];
  for (let at = 8; at < png.length; at += 12 + png.readUInt32BE(at)) {
    const size = png.readUInt32BE(at), kind = png.toString("latin1", at + 4, at + 8);
    const content = png.subarray(at + 8, at + 8 + size);
    if (kind === "IHDR") {
      [width, height] = [content.readUInt32BE(0), content.readUInt32BE(4)];
      assert.deepStrictEqual([content[8], content[9]], [8, 0], "8 bits of gray");
    } else if (kind === "IDAT") packed.push(content);
  }
  const raw = zlib.inflateSync(Buffer.concat(packed)), gray = Buffer.alloc(width * height);
  for (let y = 0; y < height; ++y) {
    const kind = raw[y * (width + 1)];
    for (let x = 0; x < width; ++x) {
      const i = y * width + x, a = x ? gray[i - 1] : 0, b = y ? gray[i - width] : 0;
      const c = x && y ? gray[i - width - 1] : 0, p = a + b - c;
      const [da, db, dc] = [a, b, c].map((q) => Math.abs(p - q));
      const paeth = da <= db && da <= dc ? a : db <= dc ? b : c;
      gray[i] = raw[y * (width + 1) + 1 + x] + [0, a, b, (a + b) >> 1, paeth][kind];
    }
  }
  return { width, height, gray };
}

function compareImages(topic, sequence) {
  const files = fs.readFileSync(path.join(sequence, "rgb.txt"), "utf8").split("\n").filter((l) => l && l[0] !== "#");
  assert.strictEqual(topic.length, files.length);
  topic.forEach(({ time, value }, k) => {
    const [stamp, file] = files[k].split(" ");
    assert.strictEqual(time, timeOf({ timestamp: stamp }));
    assert.strictEqual(value.format, "png");
    assert.deepStrictEqual(grayOf(Buffer.from(value.data, "base64")), grayOf(fs.readFileSync(path.join(sequence, file))));
  });
}

/// Focal lengths and principal point are what a viewer draws the frustum from.
function compareCameras(topic, { width, height, fx, fy, cx, cy }) {
  for (const { value } of topic) {
    assert.deepStrictEqual([value.width, value.height], [width, height]);
    assert.deepStrictEqual(value.K, [fx, 0, cx, 0, fy, cy, 0, 0, 1]);
    assert.deepStrictEqual(value.P, [fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0]);
    assert.deepStrictEqual(value.D, [0, 0, 0, 0, 0]);
    assert.strictEqual(value.frame_id, "camera");
  }
}

/// Poses told as in a file of the TUM layout: timestamp x y z qx qy qz qw.
function comparePoses(topic, child, file) {
  const rows = fs.readFileSync(file, "utf8").split("\n").filter((l) => l && l[0] !== "#").map((l) => l.split(" ").map(Number));
  const poses = topic.filter(({ value }) => value.child_frame_id === child);
  assert.strictEqual(poses.length, rows.length, `${child} and ${file}`);
  poses.forEach(({ time, value }, k) => {
    assert.strictEqual(time, timeOf({ timestamp: rows[k][0] }));
    const { translation: t, rotation: q } = value, [, x, y, z, ...r] = rows[k];
    [[t.x, x], [t.y, y], [t.z, z]].forEach(([a, b]) => near(a, b, `${child} at ${k}`));
    const sign = Math.sign(q.w * r[3] + q.x * r[0] + q.y * r[1] + q.z * r[2]);
    [q.x, q.y, q.z, q.w].forEach((a, i) => near(sign * a, r[i], `rotation of ${child} at ${k}`));
    assert.strictEqual(value.parent_frame_id, "world");
  });
}

function compareDepths(topic, features) {
  const points = topic.flatMap(({ time, value }) => value.points.map((p) => ({ time, ...p })));
  assert.strictEqual(points.length, features.length);
  points.forEach((point, i) => {
    const row = features[i];
    assert.strictEqual(point.time, timeOf(row));
    assert.strictEqual(point.id, Number(row.id));
    assert.strictEqual(point.measured, row.measured === "1");
    assert.strictEqual(point.status, row.status);
    for (const key of ["u", "v", "Z", "sigma_Z", "Z_low", "Z_high", "Z_true", "excitation"]) {
      assert.strictEqual(point[key], numberIn(row[key]), `${key} of row ${i}`);
    }
  });
  return points.length;
}

const STATUS = ["unset", "converging", "valid", "unexcited", "coasting", "rejected", "lost"];

/// The bytes of a cloud by its own description of them.
function pointsIn(cloud) {
  const bytes = Buffer.from(cloud.data, "base64"), read = { 1: "readUInt8", 6: "readInt32LE", 8: "readDoubleLE" };
  assert.strictEqual(bytes.length % cloud.point_stride, 0);
  return Array.from({ length: bytes.length / cloud.point_stride }, (_, i) => Object.fromEntries(
    cloud.fields.map(({ name, offset, type }) => [name, bytes[read[type]](i * cloud.point_stride + offset)])));
}

/// Positions and their covariances, spheres and lines: of the points that are not lost.
function compareScenes(topics, features, { fx, fy, cx, cy }) {
  const rowsAt = new Map();
  for (const row of features) rowsAt.set(timeOf(row), [...(rowsAt.get(timeOf(row)) ?? []), row]);
  topics["/depths/cloud"].forEach(({ time, value }, k) => {
    const scene = topics["/depths/scene"][k].value, rows = rowsAt.get(time) ?? [];
    const placed = rows.filter((row) => row.status !== "lost");
    const points = pointsIn(value);
    assert.deepStrictEqual(points.map((p) => p.id), placed.map((row) => Number(row.id)));
    assert.deepStrictEqual(scene.entities.map((e) => e.id), placed.map((row) => `point ${row.id}`));
    for (const row of rows) {
      const isDeleted = scene.deletions.some((d) => d.id === `point ${row.id}`);
      assert.strictEqual(isDeleted, row.status === "lost");
    }
    points.forEach((p, i) => {
      const row = placed[i], Z = Number(row.Z), sigma_Z = Number(row.sigma_Z), entity = scene.entities[i];
      const x = p.x / Z, y = p.y / Z, sigma = Number(row.sigma_uv) / fx;
      assert.deepStrictEqual([p.z, p.sigma_z, p.z_low], [Z, sigma_Z, Number(row.Z_low)]);
      assert.strictEqual(p.z_high, row.Z_high === "" ? Infinity : Number(row.Z_high));
      assert.deepStrictEqual([p.measured, STATUS[p.status]], [Number(row.measured), row.status]);
      // The estimate's own place in the image: within the noise of where it was seen.
      near(fx * x + cx, Number(row.u), `u of point ${row.id}`, 0.02);
      near(fy * y + cy, Number(row.v), `v of point ${row.id}`, 0.02);
      const covariance = { cov_xx: (Z * sigma) ** 2 + (x * sigma_Z) ** 2, cov_xy: x * y * sigma_Z ** 2,
                           cov_xz: x * sigma_Z ** 2, cov_yy: (Z * sigma) ** 2 + (y * sigma_Z) ** 2,
                           cov_yz: y * sigma_Z ** 2, cov_zz: sigma_Z ** 2 };
      for (const [name, expected] of Object.entries(covariance)) near(p[name] / covariance.cov_zz, expected / covariance.cov_zz, name);
      assert.deepStrictEqual(entity.spheres[0].pose.position, { x: p.x, y: p.y, z: p.z });
      const [from, to] = entity.lines[0].points;
      near(from.z, p.z_low, "the interval's near end");
      near(to.z, Math.min(p.z_high, 4 * Z), "its far end");
      for (const end of [from, to]) { near(end.x / end.z, x, "on the line of sight"); near(end.y / end.z, y, "on the line of sight"); }
      assert.strictEqual(entity.metadata[0].value, row.status);
      assert.strictEqual(entity.texts[0].text, row.id);
      assert.strictEqual(entity.frame_id, "camera");
    });
  });
}

function compareAnnotations(topic, features, goals) {
  const seen = features.filter((row) => row.u !== "");
  const circles = topic.flatMap(({ value }) => value.circles.slice(goals.length));
  for (const { value } of topic) {
    const drawn = value.circles.slice(0, goals.length).map(({ position: p }) => [p.x, p.y]);
    assert.deepStrictEqual(drawn, goals);
  }
  assert.deepStrictEqual(circles.map(({ position: p }) => [p.x, p.y]), seen.map((row) => [Number(row.u), Number(row.v)]));
  assert.deepStrictEqual(circles.map((c) => nanoseconds(c.timestamp)), seen.map(timeOf));
  assert.deepStrictEqual(topic.flatMap(({ value }) => value.texts.map((t) => t.text)), seen.map((row) => row.id));
}

/// Of each row of a trajectory: whether the motion that led to it is known.
function motionsIn(tum) {
  const lines = fs.readFileSync(tum, "utf8").split("\n"), known = [];
  lines.forEach((line, i) => { if (line && line[0] !== "#") known.push(known.length > 0 && lines[i - 1][0] !== "#"); });
  return known;
}

/// Commands, what was done, twists, the robot's pose.
function compareRobot(topic, frames, isKnown) {
  const columns = Object.keys(frames[0]);
  let known = 0;
  topic.forEach(({ time, value }, k) => {
    const row = frames[k];
    assert.strictEqual(time, timeOf(row));
    assert.strictEqual(value.error_px, numberIn(row.error_px));
    for (const group of ["command", "applied"]) {
      for (const column of columns.filter((c) => c.startsWith(`${group}_`))) {
        assert.strictEqual(value[group]?.[column.slice(group.length + 1)], numberIn(row[column]), column);
      }
    }
    for (const key of ["x", "y", "theta"]) assert.strictEqual(value.pose?.[key], numberIn(row[`robot_${key}`]), key);
    for (const key of ["vx", "vy", "vz", "wx", "wy", "wz"]) {
      if (value.twist) assert.strictEqual(value.twist[key], Number(row[key]), key);
    }
    assert.strictEqual(value.twist !== undefined, isKnown[k], `the motion before image ${k}`);
    known += isKnown[k];
  });
  assert(known > 0.9 * frames.length, `${known} of ${frames.length} motions are known`);
}

function compareWords(topics, run) {
  const words = (topic) => (topics[topic] ?? []).map(({ time, value }) => [time, value.message]);
  const events = run.events.map(({ time, what }) => [timeOf({ timestamp: time }), what]);
  assert.deepStrictEqual(words("/events"), events);
  const told = words("/diagnosis").map(([, message]) => message);
  for (const message of [run.diagnosis.cause === "none" ? "images and odometry agree with what was declared of them" : run.diagnosis.message, run.reason].filter(Boolean)) {
    assert(told.includes(message), `"${message}" is not in ${JSON.stringify(told)}`);
  }
}

(async () => {
  run("record", path.join(data, "scenarios/unicycle-4dots-hidden.yaml"), at("sequence"), "--set", "duration=8",
      "--set", "expect=null");
  const runs = [
    ["run", path.join(data, "scenarios/unicycle-4dots-hidden.yaml"), "--set", "duration=8", "--set", "expect=null"],
    ["replay", at("sequence")],
  ];
  for (const [i, args] of runs.entries()) {
    const file = at(`${i}.mcap`);
    run(...args, "--mcap", file, "--tum", at(`${i}.tum`), "--out", at(`${i}.run`));
    const topics = readWhole(file);
    const messages = await readBySeeking(file);
    const features = csv(at(`${i}.run/features.csv`)), frames = csv(at(`${i}.run/frames.csv`));
    const told = JSON.parse(fs.readFileSync(at(`${i}.run/run.json`), "utf8"));
    for (const [topic, all] of Object.entries(topics)) {
      for (const { time, value } of all) if (value.timestamp) assert.strictEqual(nanoseconds(value.timestamp), time, topic);
      const isWords = topic === "/events" || topic === "/diagnosis";
      if (!isWords && topic !== "/tf") assert.strictEqual(all.length, frames.length, topic);
    }
    compareImages(topics["/camera/image"], at("sequence"));
    compareCameras(topics["/camera/calibration"], told.camera);
    comparePoses(topics["/tf"], "camera", at(`${i}.tum`));
    if (args[0] === "run") comparePoses(topics["/tf"], "camera_true", at("sequence/groundtruth.txt"));
    const values = compareDepths(topics["/depths"], features);
    compareScenes(topics, features, told.camera);
    compareAnnotations(topics["/camera/annotations"], features, told.goals);
    compareRobot(topics["/robot"], frames, motionsIn(at(`${i}.tum`)));
    compareWords(topics, told);
    console.log(`${args[0]}: ${messages} messages, ${values} depths and all other topics as in the run folder, ` +
                `${fs.statSync(file).size} bytes`);
  }
})().catch((error) => { console.error(error); process.exit(1); });
