// Events of a run that may last for weeks, and whose far end may make up as many as it likes: bounded, but the first of
// each kind is always among those that are kept.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace knuckle::programs {

/// Kinds of events met so far.
class EventKinds {
 public:
  static constexpr std::size_t kMost = 1024;  ///< More than any honest run has; the next count as known.
  /// @return whether this is the first of its kind.
  bool first(const std::string& kind) { return kinds_.size() < kMost && kinds_.insert(kind).second; }

 private:
  std::set<std::string> kinds_;
};

/// The first event of each kind, and of all others the newest.
template <typename Event>
class RunEvents {
 public:
  static constexpr std::size_t kMostOthers = 2000;

  /// @param kind of a bounded number: without times, values, and what a far end may choose freely.
  void add(const Event& event, const std::string& kind) {
    auto& kept = kinds_.first(kind) ? firsts_ : others_;
    kept.emplace_back(count_++, event);
    if (others_.size() <= kMostOthers) return;
    others_.pop_front();
    ++left_out_;
  }
  /// In the order they were added.
  [[nodiscard]] std::vector<Event> kept() const {
    std::vector<Numbered> all(firsts_.begin(), firsts_.end());
    all.insert(all.end(), others_.begin(), others_.end());
    std::sort(all.begin(), all.end(), [](const Numbered& a, const Numbered& b) { return a.first < b.first; });
    std::vector<Event> events;
    for (const Numbered& event : all) events.push_back(event.second);
    return events;
  }
  [[nodiscard]] std::uint64_t left_out() const noexcept { return left_out_; }

 private:
  using Numbered = std::pair<std::uint64_t, Event>;
  EventKinds kinds_;
  std::deque<Numbered> firsts_, others_;
  std::uint64_t count_ = 0, left_out_ = 0;
};

}  // namespace knuckle::programs
