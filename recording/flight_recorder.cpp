#include "recording/flight_recorder.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "recording/file_names.h"
#include "recording/topics.h"

namespace knuckle::recording {

FlightRecorder::FlightRecorder(std::string folder, Head head) : folder_(std::move(folder)), head_(std::move(head)) {
  head_.part = 0;
}

mcap::Chunk FlightRecorder::take(mcap::Chunk chunk) {
  if (folder_.empty()) return chunk;
  const auto time_of = [this](std::uint64_t unix_ns) {
    return Time(Duration(static_cast<std::int64_t>(unix_ns) - head_.started_unix_ns));
  };
  const Time newest = time_of(chunk.last_time_ns);
  kept_.push_back(std::move(chunk));
  if (triggered_at_ != kNever) {
    if (!open_) {
      begin();
    } else if (!file_.append(kept_.back())) {
      failed_ = true;
    }
    if (failed_ || newest - newest_trigger_ >= kAfter || newest - triggered_at_ >= kLongest) end();
  }
  mcap::Chunk old;
  while (newest - time_of(kept_.front().last_time_ns) > kBefore) {
    old = std::move(kept_.front());
    kept_.pop_front();
  }
  return old;
}

void FlightRecorder::trigger(Time at, const std::string& why) {
  newest_trigger_ = at;
  if (folder_.empty() || triggered_at_ != kNever) return;
  triggered_at_ = at;
  why_ = why;
}

void FlightRecorder::begin() {
  open_ = true;
  path_ = folder_ + "/" + flight_name(head_, triggered_at_, why_);
  failed_ = !make_folder(folder_) || !file_.open(path_, topics()) || !file_.note(metadata_of(head_));
  for (const mcap::Attachment& attachment : attachments_of(head_)) failed_ = failed_ || !file_.attach(attachment);
  for (const mcap::Chunk& chunk : kept_) failed_ = failed_ || !file_.append(chunk);
}

void FlightRecorder::end() {
  const int error = failed_ ? (file_.error() != 0 ? file_.error() : errno) : 0;
  failed_ = !file_.close() || failed_;
  if (on_file) on_file(triggered_at_, path_, failed_ ? std::strerror(error != 0 ? error : file_.error()) : "");
  triggered_at_ = kNever;
  open_ = failed_ = false;
}

void FlightRecorder::close() {
  if (triggered_at_ == kNever) return;
  if (!open_) begin();
  end();
}

}  // namespace knuckle::recording
