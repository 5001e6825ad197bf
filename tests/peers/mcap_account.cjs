// As mcap_account, by @mcap/core: node mcap_account.cjs indexed|stream FILE. All CRCs are checked on the way.
const fs = require("fs");
const { crc32 } = require("@foxglove/crc");
const { McapIndexedReader, McapStreamReader } = require("@mcap/core");
const { decompress } = require("fzstd");

const decompressHandlers = { zstd: (bytes, size) => decompress(bytes, new Uint8Array(Number(size))) };
const accounts = new Map();
const lines = [];

function addMessage(topic, message) {
  const a = accounts.get(topic) ?? { messages: 0, first: message.logTime, last: message.logTime, sum: 0 };
  a.messages += 1;
  if (message.logTime < a.first) a.first = message.logTime;
  if (message.logTime > a.last) a.last = message.logTime;
  a.sum = (a.sum + crc32(message.data)) >>> 0;
  accounts.set(topic, a);
}
const addAttachment = (a) => lines.push(`attachment ${a.name}: ${Buffer.from(a.data).toString().trimEnd()}`);
function addMetadata(m) {
  const values = [...m.metadata].sort().map(([key, value]) => ` ${key}=${value}`);
  lines.push(`metadata ${m.name}${values.join("")}`);
}

async function readIndexed(file) {
  const bytes = fs.readFileSync(file);
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, size) => new Uint8Array(bytes.subarray(Number(offset), Number(offset + size))),
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  for await (const m of reader.readMessages({ validateCrcs: true })) addMessage(reader.channelsById.get(m.channelId).topic, m);
  for await (const a of reader.readAttachments({ validateCrcs: true })) addAttachment(a);
  for await (const m of reader.readMetadata()) addMetadata(m);
  if (crc32(bytes.subarray(0, Number(reader.dataEndOffset))) !== reader.dataSectionCrc) throw new Error("data section CRC");
  let messages = 0;
  for (const a of accounts.values()) messages += a.messages;
  if (BigInt(messages) !== reader.statistics.messageCount) throw new Error("statistics count other messages");
}

function readStream(file) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  reader.append(fs.readFileSync(file));
  const topics = new Map();
  for (let r; (r = reader.nextRecord()); ) {
    if (r.type === "Channel") topics.set(r.id, r.topic);
    if (r.type === "Message") addMessage(topics.get(r.channelId), r);
    if (r.type === "Attachment") addAttachment(r);
    if (r.type === "Metadata") addMetadata(r);
  }
}

async function main([how, file]) {
  if (how === "indexed") await readIndexed(file);
  else readStream(file);
  for (const topic of [...accounts.keys()].sort()) {
    const a = accounts.get(topic);
    console.log(`${topic} ${a.messages} messages, ${a.first} to ${a.last} ns, sum ${a.sum.toString(16).padStart(8, "0")}`);
  }
  for (const kind of ["attachment", "metadata"]) lines.filter((l) => l.startsWith(kind)).forEach((l) => console.log(l));
}
main(process.argv.slice(2)).catch((error) => {
  console.error(error.message);
  process.exit(1);
});
