// Reads a file of MCAP by @mcap/core, twice: from its start to its end and by its index; decodes each message by the
// definition that the file has of its type.
//   node read_bag.mjs PACKAGES FILE      PACKAGES: the node_modules of package.json beside this
// Prints what the file is, in JSON, then a line a message in the order of the index: topic, type, log time, sequence
// number, fields. Bytes are hexadecimal digits; what JSON has no number for is a text.

import { createRequire } from "node:module";
import { open, readFile } from "node:fs/promises";

const [packages, path] = process.argv.slice(2);
const require = createRequire(packages + "/x.js");
const { McapIndexedReader, McapStreamReader } = require("@mcap/core");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");

const file = await open(path);
const readable = {
  size: async () => BigInt((await file.stat()).size),
  read: async (offset, size) => {
    const bytes = new Uint8Array(Number(size));
    await file.read(bytes, 0, Number(size), Number(offset));
    return bytes;
  },
};

// From start to end; CRCs of chunks, of the data and of attachments are checked.
const stream = new McapStreamReader({ includeChunks: true, validateCrcs: true });
stream.append(new Uint8Array(await readFile(path)));
const counts = {};
const metadata = {};
let dataEnd = null;
for (let record; (record = stream.nextRecord()) != null; ) {
  counts[record.type] = (counts[record.type] ?? 0) + 1;
  if (record.type === "Metadata") metadata[record.name] = Object.fromEntries(record.metadata);
  if (record.type === "DataEnd") dataEnd = record.dataSectionCrc;
}
if (!stream.done()) throw new Error("the stream has no end");

const reader = await McapIndexedReader.Initialize({ readable });
const summary = {
  profile: reader.header.profile,
  library: reader.header.library,
  counts,
  metadata,
  data_crc: dataEnd,
  summary_crc: reader.footer.summaryCrc,
  statistics: {
    messages: Number(reader.statistics.messageCount),
    chunks: reader.statistics.chunkCount,
    channels: reader.statistics.channelCount,
    schemas: reader.statistics.schemaCount,
    start: String(reader.statistics.messageStartTime),
    end: String(reader.statistics.messageEndTime),
  },
  topics: Object.fromEntries(
    [...reader.channelsById.values()].map((c) => [
      c.topic,
      {
        encoding: c.messageEncoding,
        schema: reader.schemasById.get(c.schemaId).encoding,
        qos: c.metadata.get("offered_qos_profiles"),
        count: Number(reader.statistics.channelMessageCounts.get(c.id)),
      },
    ]),
  ),
};
console.log(JSON.stringify(summary));

const decoders = new Map();
const decoder = (id) => {
  if (!decoders.has(id)) {
    const text = new TextDecoder().decode(reader.schemasById.get(id).data);
    decoders.set(id, new MessageReader(parse(text, { ros2: true })));
  }
  return decoders.get(id);
};
const plain = (key, value) => {
  if (typeof value === "bigint") return String(value);
  if (typeof value === "number" && !Number.isFinite(value)) return String(value);
  if (value instanceof Uint8Array) return Buffer.from(value).toString("hex");
  if (ArrayBuffer.isView(value)) return Array.from(value);
  return value;
};
for await (const message of reader.readMessages({ validateCrcs: true })) {
  const channel = reader.channelsById.get(message.channelId);
  console.log(
    JSON.stringify(
      {
        topic: channel.topic,
        type: reader.schemasById.get(channel.schemaId).name,
        log_ns: String(message.logTime),
        publish_ns: String(message.publishTime),
        sequence: message.sequence,
        fields: decoder(channel.schemaId).readMessage(message.data),
      },
      plain,
    ),
  );
}
await file.close();
