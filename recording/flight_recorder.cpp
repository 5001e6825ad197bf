#include "recording/flight_recorder.h"

#include <cerrno>
#include <cstring>
#include <utility>

#include "recording/file_names.h"

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
      fail(file_.error());
    }
    mark_.renew();
    if (failed_ || newest - newest_trigger_ >= kAfter) end();
  }
  mcap::Chunk old;
  while (newest - time_of(kept_.front().last_time_ns) > kBefore) {
    old = std::move(kept_.front());
    kept_.pop_front();
  }
  return old;
}

bool FlightRecorder::trigger(Time at, const std::string& why) {
  if (folder_.empty()) return true;
  if (triggered_at_ == kNever) {
    if (!may_begin(at)) return false;
    triggered_at_ = newest_trigger_ = at;
    why_ = why;
  } else if (at - triggered_at_ <= kLongest - kAfter) {
    newest_trigger_ = at;
  } else if (next_at_ == kNever) {
    if (!may_begin(at)) return false;
    next_at_ = at;
    next_why_ = why;
  }
  return true;
}

bool FlightRecorder::may_begin(Time at) {
  while (!begun_at_.empty() && at - begun_at_.front() >= std::chrono::hours(1)) begun_at_.pop_front();
  if (begun_at_.size() >= kMostPerHour) return false;
  begun_at_.push_back(at);
  return true;
}

void FlightRecorder::begin() {
  open_ = true;
  path_ = folder_ + "/" + flight_name(head_, triggered_at_, why_);
  const std::string made = make_folder(folder_) ? open_new(file_, path_) : "";
  if (made.empty()) {
    fail(errno);
    return;
  }
  path_ = made;
  mark_ = NewestMark(path_);
  bool written = file_.note(metadata_of(head_));
  for (const mcap::Attachment& attachment : attachments_of(head_)) written = written && file_.attach(attachment);
  for (const mcap::Chunk& chunk : kept_) written = written && file_.append(chunk);
  if (!written) fail(file_.error());
  mark_.renew();
}

void FlightRecorder::fail(int error) {
  failed_ = true;
  problem_ = std::strerror(error);
}

void FlightRecorder::end() {
  if (failed_)
    file_.abandon();
  else if (!file_.close())
    fail(file_.error());
  mark_.renew();
  if (on_file) on_file(triggered_at_, path_, problem_);
  open_ = failed_ = false;
  problem_.clear();
  triggered_at_ = newest_trigger_ = std::exchange(next_at_, kNever);
  why_ = next_why_;
}

void FlightRecorder::close() {
  while (triggered_at_ != kNever) {
    if (!open_) begin();
    end();
  }
}

}  // namespace knuckle::recording
