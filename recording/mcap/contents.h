// What an MCAP file holds besides messages: schemas, channels, attachments, metadata. Times are nanoseconds since an
// epoch that the user of the format chooses.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <new>
#include <string>
#include <vector>

namespace knuckle::mcap {

/// Memory that is not zeroed before it is overwritten.
template <typename T>
struct UninitializedAllocator : std::allocator<T> {
  template <typename U>
  void construct(U* at) noexcept {
    ::new (static_cast<void*>(at)) U;
  }
};
using Bytes = std::vector<std::uint8_t, UninitializedAllocator<std::uint8_t>>;

using Texts = std::map<std::string, std::string>;

struct Schema {
  std::string name;
  std::string encoding;  ///< "jsonschema", "protobuf", ...: https://mcap.dev/spec/registry
  std::string data;
  bool operator==(const Schema&) const = default;
};

struct Channel {
  std::string topic;
  std::string message_encoding;  ///< "json", "protobuf", ...: https://mcap.dev/spec/registry
  std::uint16_t schema_id = 0;   ///< 0: has none.
  Texts metadata;
  bool operator==(const Channel&) const = default;
};

/// Schemas and channels of a file by their ids.
struct Topics {
  std::map<std::uint16_t, Schema> schemas;
  std::map<std::uint16_t, Channel> channels;

  /// Adds it under the next free id, from 1 on. @return that id. @throws std::length_error where all 65535 are taken.
  std::uint16_t add(Schema schema);
  std::uint16_t add(Channel channel);
};

struct Attachment {
  std::string name;
  std::string media_type;
  std::uint64_t log_time_ns = 0;
  std::uint64_t create_time_ns = 0;  ///< 0: not known.
  std::string data;
};

struct Metadata {
  std::string name;
  Texts values;
  bool operator==(const Metadata&) const = default;
};

}  // namespace knuckle::mcap
