// Recordings copied message by message, with changes: every CRC of the new file is right, so that whatever is noticed
// is noticed by replay and not by the file's reader.
#pragma once

#include <libdeflate.h>

#include <cstdint>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "recording/cdr.h"
#include "recording/head.h"
#include "recording/mcap/chunk.h"
#include "recording/mcap/file_writer.h"
#include "recording/recording.h"
#include "recording/wire_events.h"

namespace knuckle::test {

/// What to do with a message: it may be changed; false leaves it out.
using EditMessage = std::function<bool(const std::string& topic, std::vector<std::uint8_t>& message)>;

/// @param to must not exist. @param head that it gets. @param edit_topics may be empty. @throws std::runtime_error
/// where it cannot be written.
inline void rewrite(const std::string& from, const std::string& to, const recording::Head& head,
                    mcap::Compression compression, const EditMessage& edit,
                    const std::function<void(mcap::Topics&)>& edit_topics = {}) {
  constexpr std::size_t kChunkBytes = std::size_t{8} << 20;
  const auto require = [&](bool written) {
    if (!written) throw std::runtime_error(to + " cannot be written");
  };
  mcap::Reader reader(from);
  mcap::FileWriter writer;
  mcap::Topics topics = reader.topics();
  if (edit_topics) edit_topics(topics);
  require(writer.open(to, topics));
  require(writer.note(metadata_of(head)));
  for (const mcap::Attachment& attachment : attachments_of(head)) require(writer.attach(attachment));
  mcap::ChunkBuilder chunk;
  while (const auto message = reader.next()) {
    std::vector<std::uint8_t> data(message->data.begin(), message->data.end());
    if (!edit(reader.topics().channels.at(message->channel_id).topic, data)) continue;
    chunk.add(message->channel_id, message->sequence, message->log_time_ns, message->publish_time_ns, data);
    if (chunk.bytes() > kChunkBytes) require(writer.append(chunk.finish(compression)));
  }
  if (!chunk.empty()) require(writer.append(chunk.finish(compression)));
  require(writer.close());
}

/// A message of the wires' topics. @param new_crc false: the check sum stays what it was, as where the events were
/// altered by somebody who does not know of it.
inline std::vector<std::uint8_t> encode_wires(const recording::StepWires& wires, bool new_crc) {
  constexpr std::size_t kHead = 28;  // of the message, up to the first event
  std::size_t size = kHead;
  for (const recording::WireEvent& event : wires.events) size += event.data.size() + 16;
  std::vector<std::uint8_t> room(size);
  const auto fill = [&](std::uint32_t crc) {
    recording::CdrWriter out(room);
    out.put(static_cast<std::int64_t>(wires.at.time_since_epoch().count()));
    out.put(wires.step);
    out.put(crc);
    out.put(wires.lost);
    out.put(static_cast<std::uint32_t>(wires.events.size()));
    for (const recording::WireEvent& event : wires.events) {
      out.put(static_cast<std::uint8_t>(event.kind));
      out.put(event.value);
      out.put_bytes(event.data);
    }
    return out.size();
  };
  room.resize(fill(wires.crc));
  if (new_crc) (void)fill(libdeflate_crc32(0, room.data() + kHead, room.size() - kHead));
  return room;
}

}  // namespace knuckle::test
