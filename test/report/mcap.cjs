// MCAP files of run and replay, read by others' code: the reader of MCAP's own project, with all CRCs, and a
// validator of JSON schemas; values against features.csv.
//   node mcap.cjs TOOL DATA NODE_MODULES
// Exit code 77: @mcap/core, ajv or fzstd is not there (npm install --prefix DIR @mcap/core ajv fzstd).

const { execFileSync } = require("child_process");
const fs = require("fs"), os = require("os"), path = require("path"), assert = require("assert");
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

function compare(topics, features) {
  const points = topics["/depths"].flatMap(({ time, value }) => value.points.map((p) => ({ time, ...p })));
  assert.strictEqual(points.length, features.length);
  points.forEach((point, i) => {
    const row = features[i];
    assert.strictEqual(Number(point.time), Math.round(Number(row.timestamp) * 1e9));
    assert.strictEqual(point.id, Number(row.id));
    assert.strictEqual(point.measured, row.measured === "1");
    assert.strictEqual(point.status, row.status);
    for (const key of ["u", "v", "Z", "sigma_Z", "Z_low", "Z_high", "Z_true", "excitation"]) {
      assert.strictEqual(point[key], row[key] === "" ? undefined : Number(row[key]), `${key} of row ${i}`);
    }
  });
  return points.length;
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
    const values = compare(topics, csv(at(`${i}.run/features.csv`)));
    const frames = csv(at(`${i}.run/frames.csv`)).length;
    for (const topic of ["/camera/image", "/camera/calibration", "/depths/cloud", "/depths/scene"]) {
      assert.strictEqual(topics[topic].length, frames, topic);
    }
    assert.strictEqual(fs.readFileSync(at(`${i}.tum`), "utf8").split("\n").filter((l) => l && l[0] !== "#").length,
                       frames);
    console.log(`${args[0]}: ${messages} messages, ${values} depths as in features.csv, ` +
                `${fs.statSync(file).size} bytes`);
  }
})().catch((error) => { console.error(error); process.exit(1); });
