// Reads a recording with @mcap/core, the reference reader. Prints one line of JSON with the number of messages of each
// channel and the time of the last message. A truncated file, e.g. after kill -9, is read up to its last complete
// record.
import { McapStreamReader } from "@mcap/core";
import { decompress } from "fzstd";
import { readFileSync } from "node:fs";

const reader = new McapStreamReader({
  validateCrcs: true,
  decompressHandlers: { zstd: (bytes, size) => decompress(bytes, new Uint8Array(Number(size))) },
});
reader.append(readFileSync(process.argv[2]));
const names = new Map(), topics = {};
let isWhole = false;
for (let record = reader.nextRecord(); record; record = reader.nextRecord()) {
  if (record.type === "Channel") names.set(record.id, record.topic);
  if (record.type === "Footer") isWhole = true;
  if (record.type !== "Message") continue;
  const topic = (topics[names.get(record.channelId)] ??= { messages: 0, last_ns: "0" });
  topic.messages += 1;
  topic.last_ns = record.logTime.toString();
}
console.log(JSON.stringify({ is_whole: isWhole, topics }));
