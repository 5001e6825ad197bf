// A recording as it is read: one file, or the parts of one in their order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/time.h"
#include "recording/fields.h"
#include "recording/head.h"
#include "recording/mcap/reader.h"
#include "recording/states.h"
#include "recording/topics.h"

namespace knuckle::recording {

/// One message.
struct Entry {
  Topic topic{};
  Time at{};                           ///< Session time.
  std::span<const std::uint8_t> data;  ///< Until the next one is asked for. A state in today's form.
  std::span<const std::string> lacks;  ///< Of a state: schema names of fields that were not recorded.
};

/// From the states of a channel to today's. Nothing where they are as today's, or the channel has none.
/// @param where file and topic. @throws InputError as StateTranslation does.
[[nodiscard]] std::optional<StateTranslation> translation_of(const mcap::Topics& topics, const mcap::Channel& channel,
                                                             const std::string& where);
/// "recorded by another version of Knuckle, without payload_kg"; empty where nothing lacks.
[[nodiscard]] std::string lacks_text(const StateTranslation& translation);

class Recording {
 public:
  /// @param paths the parts, the first one first. @throws InputError where one cannot be opened, is no recording of
  /// Knuckle's, or is of another session or another part than the one before it says.
  explicit Recording(const std::vector<std::string>& paths);

  /// Of the first part, with the files that are attached.
  [[nodiscard]] const Head& head() const noexcept { return head_; }
  [[nodiscard]] const std::string& source() const noexcept { return paths_.front(); }
  /// The next one, part by part, in the order of log times; messages of topics that are not Knuckle's are left out.
  /// nullopt at the end. @throws InputError at a state whose fields have other types than today's.
  [[nodiscard]] std::optional<Entry> next();
  /// next() goes on with the first chunk that reaches this time.
  void seek(Time from);
  /// Of all messages, from the files' own tables; nothing where there is no message.
  struct Span {
    Time first{}, last{};
  };
  [[nodiscard]] std::optional<Span> span() const;
  /// What of the files cannot be read, a line each; complete once next() has come to its end.
  [[nodiscard]] std::vector<std::string> damages() const;
  /// What is unusual in the files and takes nothing away, a line each: not in the order of time, something twice,
  /// fields that were not recorded; complete likewise.
  [[nodiscard]] std::vector<std::string> order_notes() const;
  /// Every part was finished in order.
  [[nodiscard]] bool complete() const;

 private:
  /// What a channel of a part has.
  struct Source {
    std::optional<Topic> topic;  ///< None of Knuckle's: nothing.
    std::optional<StateTranslation> translation;
  };
  [[nodiscard]] std::optional<Entry> entry_of(const mcap::Message& message);
  [[nodiscard]] Source source_of(std::uint16_t channel_id) const;
  [[nodiscard]] Time time_of(std::uint64_t unix_ns) const noexcept {
    return Time(Duration(static_cast<std::int64_t>(unix_ns) - head_.started_unix_ns));
  }

  std::vector<std::string> paths_;
  std::vector<std::unique_ptr<mcap::Reader>> parts_;
  std::size_t part_ = 0;
  std::map<std::pair<std::size_t, std::uint16_t>, Source> sources_;  ///< By part and channel, once it was met.
  Head head_;
};

[[noreturn]] void refuse_state(const Entry& entry, const Recording& recording);
/// @throws InputError where it is no state.
template <typename State>
[[nodiscard]] State state_in(const Entry& entry, const Recording& recording) {
  State state;
  if (!decode(entry.data, state)) refuse_state(entry, recording);
  return state;
}

// What a recording lacks of the session that it is of.

/// A line for each place that cannot be read, and one where it has no end; complete once next() has come to its end.
/// Empty: it is whole.
[[nodiscard]] std::vector<std::string> defects(const Recording& recording);
/// All that a reader should be told of the files: defects, and what is unusual in their order.
[[nodiscard]] std::vector<std::string> remarks(const Recording& recording);

}  // namespace knuckle::recording
