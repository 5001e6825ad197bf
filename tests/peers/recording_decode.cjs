// A recording as Foxglove reads it: node recording_decode.cjs FILE. Every message is decoded by the schema that the file
// itself has, and encoded again: the bytes must be the same. Foxglove's own schemas are compared with @foxglove/schemas.
const assert = require("assert/strict");
const fs = require("fs");
const { McapIndexedReader } = require("@mcap/core");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader, MessageWriter } = require("@foxglove/rosmsg2-serialization");
const { foxgloveMessageSchemas, generateRosMsgMergedSchema } = require("@foxglove/schemas/internal");
const { decompress } = require("fzstd");

const decompressHandlers = { zstd: (bytes, size) => decompress(bytes, new Uint8Array(Number(size))) };
const parsed = (text) => parse(text, { ros2: true });

/// Fields and constants of each message in a schema, by the message's name; times are built in, and left out.
function fieldsOf(text, root) {
  const messages = new Map();
  for (const { name, definitions } of parsed(text))
    if (!(name ?? root).startsWith("builtin_interfaces/")) messages.set(name ?? root, definitions);
  return messages;
}

function checkSchema({ name, data }) {
  const own = foxgloveMessageSchemas[name.replace("foxglove_msgs/msg/", "")];
  const ours = fieldsOf(Buffer.from(data).toString(), name);
  const theirs = fieldsOf(generateRosMsgMergedSchema(own, { rosVersion: 2 }), name);
  assert.deepEqual([...ours.keys()].sort(), [...theirs.keys()].sort(), `${name}: other messages within`);
  let fields = 0;
  for (const [message, definitions] of theirs) {
    assert.deepEqual(ours.get(message), definitions, `${name}: ${message} differs`);
    fields += definitions.length;
  }
  console.log(`${name}: ${theirs.size} messages with ${fields} fields and constants are Foxglove's`);
}

async function main([path]) {
  const bytes = fs.readFileSync(path);
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, size) => new Uint8Array(bytes.subarray(Number(offset), Number(offset + size))),
  };
  const file = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  const foxglove = [...file.schemasById.values()].filter(({ name }) => name.startsWith("foxglove_msgs/"));
  const names = foxglove.map(({ name }) => name.split("/").pop()).sort();
  assert.deepEqual(names, ["CompressedImage", "FrameTransforms", "Log", "SceneUpdate"]);
  foxglove.forEach(checkSchema);

  const topics = new Map();
  for (const [id, channel] of file.channelsById) {
    const schema = file.schemasById.get(channel.schemaId);
    assert.equal(channel.messageEncoding, "cdr");
    assert.equal(schema.encoding, "ros2msg");
    const definitions = parsed(Buffer.from(schema.data).toString());
    const reader = new MessageReader(definitions), writer = new MessageWriter(definitions);
    topics.set(id, { topic: channel.topic, schema: schema.name, reader, writer, messages: 0, bytes: 0 });
  }
  for await (const { channelId, data } of file.readMessages({ validateCrcs: true })) {
    const topic = topics.get(channelId);
    const again = topic.writer.writeMessage(topic.reader.readMessage(data));
    assert.ok(Buffer.from(again).equals(data), `${topic.topic}: message ${topic.messages} has other bytes when encoded again`);
    topic.messages += 1;
    topic.bytes += data.length;
  }
  for (const { topic, schema, messages, bytes: size } of topics.values()) {
    const maybe = topic === "/events" || topic.startsWith("/camera/");  // a session without any
    assert.ok(messages > 0 || maybe, `${topic}: no messages`);
    console.log(`${topic} (${schema}): ${messages} messages decoded, ${size} bytes`);
  }
}
main(process.argv.slice(2)).catch((error) => {
  console.error(error.message);
  process.exit(1);
});
