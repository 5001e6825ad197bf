#include "recording/recorder.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <utility>

#include "core/error.h"
#include "recording/fields.h"
#include "recording/file_names.h"

namespace knuckle::recording {
namespace {

constexpr Duration kDrainPeriod = 20ms;
constexpr std::size_t kChunkBytes = std::size_t{4} << 20;

Time time_at(std::int64_t ns) {
  return Time(Duration(ns));
}

}  // namespace

Recorder::Recorder(RecorderOptions options, Head head, const MachineDescription& machine)
    : options_(std::move(options)), head_(std::move(head)), scene_(machine), flights_(options_.folder, head_) {
  for (auto& ring : rings_) ring = std::make_unique<ByteRing>(options_.ring_bytes);
  flights_.on_file = [this](Time at, const std::string& file, const std::string& problem) {
    if (!problem.empty())
      return notice(at, Severity::kError, "flight record " + file + " could not be written: " + problem);
    {
      const std::scoped_lock lock(mutex_);
      status_.flights.push_back(file);
    }
    say(at, Severity::kInfo, "flight record: " + file);
  };
  if (!options_.keep) {
    if (!options_.folder.empty() && !make_folder(options_.folder))
      notice({}, Severity::kError,
             "no flight record can be written to " + options_.folder + ": " + std::strerror(errno));
    return;
  }
  if (!options_.file.empty() && !may_be_replaced(options_.file))
    throw InputError("--log " + options_.file + ": is not a regular file");
  if (!open_part(0)) {
    const std::string where = options_.file.empty() ? options_.folder : options_.file;
    throw InputError("--log " + where + ": cannot be written: " + std::strerror(errno));
  }
}

Recorder::~Recorder() {
  close();
}

void Recorder::event(const Event& event) {
  post(Topic::kEvents, event.at, encode_log(event, head_.started_unix_ns));
}

void Recorder::camera(const CameraStamp& stamp) {
  post(Topic::kCameraStamps, stamp.at, encode_camera_stamp(stamp));
}

void Recorder::camera(const CameraPicture& picture) {
  post(Topic::kCameraPictures, picture.at, encode_camera_picture(picture, head_.started_unix_ns));
}

void Recorder::post(Topic topic, Time at, std::vector<std::uint8_t> message) {
  const std::scoped_lock lock(mutex_);
  posted_.push_back({topic, at.time_since_epoch().count(), std::move(message)});
}

void Recorder::say(Time at, Severity severity, const std::string& text) {
  event({at, severity, "recorder", text});
}

void Recorder::notice(Time at, Severity severity, const std::string& text) {
  constexpr std::size_t kMostNotices = 1000;
  say(at, severity, text);
  const std::scoped_lock lock(mutex_);
  if (status_.notices.size() < kMostNotices) status_.notices.push_back(text);
}

RecorderStatus Recorder::status() const {
  const std::scoped_lock lock(mutex_);
  return status_;
}

void Recorder::drain() {
  for (std::size_t side = 0; side < kSides; ++side) take_steps(side);
  take_posted();
  const std::scoped_lock lock(mutex_);
  status_.recording = recording_;
  status_.bytes = bytes_before_ + file_.bytes();
  status_.steps_lost = rings_[0]->dropped() + rings_[1]->dropped();
}

void Recorder::take_steps(std::size_t side) {
  ByteRing& ring = *rings_[side];
  const Topic wires = side == 0 ? Topic::kOperatorWires : Topic::kMachineWires;
  const Topic state = side == 0 ? Topic::kOperatorState : Topic::kMachineState;
  for (auto step = ring.front(); !step.empty(); step = ring.front()) {
    StepHeader header;
    std::memcpy(&header, step.data(), sizeof header);
    const auto wires_message = step.subspan(sizeof header, header.wires_size);
    const auto state_message = step.subspan(sizeof header + header.wires_size, header.state_size);
    add(wires, header.time_ns, wires_message);
    if (!state_message.empty()) add(state, header.time_ns, state_message);
    if (side == 1 && !state_message.empty()) draw(header.time_ns, state_message);
    watch(side, time_at(header.time_ns), header.alarm);
    ring.pop();
  }
  if (const std::uint64_t lost = ring.dropped(); lost != told_lost_[side]) {
    say(time_at(newest_ns_), Severity::kWarning,
        std::to_string(lost - told_lost_[side]) + " steps of the " + (side == 0 ? "operator" : "machine") +
            "'s loop are missing: the recorder was too slow");
    told_lost_[side] = lost;
  }
}

void Recorder::take_posted() {
  std::vector<Posted> posted;
  {
    const std::scoped_lock lock(mutex_);
    posted.swap(posted_);
  }
  for (const Posted& p : posted) add(p.topic, p.time_ns, p.message);
}

/// A chunk ends before the message with which it would become too long.
void Recorder::add(Topic topic, std::int64_t time_ns, std::span<const std::uint8_t> message) {
  const auto at = static_cast<std::uint64_t>(head_.started_unix_ns + time_ns);
  const bool full = builder_.bytes() + message.size() > kChunkBytes ||
                    (at > builder_.first_time_ns() &&
                     at - builder_.first_time_ns() >= static_cast<std::uint64_t>(options_.chunk.count()));
  if (!builder_.empty() && full) finish_chunk();
  builder_.add(channel_of(topic), sequences_[static_cast<std::size_t>(topic)]++, at, at, message);
  newest_ns_ = std::max(newest_ns_, time_ns);
}

void Recorder::draw(std::int64_t time_ns, std::span<const std::uint8_t> state_message) {
  if (drawn_ns_ >= 0 && time_ns - drawn_ns_ < kScenePeriod.count()) return;
  drawn_ns_ = time_ns;
  slave::SlaveState state;
  CdrReader in(state_message);
  get(in, state);
  if (!state.measured) return;
  add(Topic::kTransforms, time_ns, scene_.transforms(state, head_.started_unix_ns));
  add(Topic::kScene, time_ns, scene_.scene(state, head_.started_unix_ns));
  if (const auto message = scene_.machine(state, head_.started_unix_ns); !message.empty())
    add(Topic::kSceneMachine, time_ns, message);
}

void Recorder::watch(std::size_t side, Time at, ReasonCode alarm) {
  const bool begins = alarm != ReasonCode::kNone && alarm != alarms_[side] && !options_.folder.empty();
  if (begins && !room_for_more(at)) {
    if (alarms_[1 - side] != alarm)  // said of the other side
      notice(at, Severity::kError, std::string("no flight record of ") + name(alarm) + ": the disk is full");
  } else if (begins && !flights_.trigger(at, name(alarm))) {
    notice(at, Severity::kWarning,
           std::string("no flight record of ") + name(alarm) + ": the last hour has had its " +
               std::to_string(FlightRecorder::kMostPerHour));
  }
  alarms_[side] = alarm;
}

void Recorder::finish_chunk() {
  mcap::Chunk chunk = builder_.finish(options_.compression, std::move(spare_));
  if (recording_) write(chunk);
  spare_ = flights_.take(std::move(chunk));
}

void Recorder::write(const mcap::Chunk& chunk) {
  const Time at = time_at(newest_ns_);
  if (options_.file.empty()) {
    if (!room_for_more(at)) {
      const std::uint64_t left = free_bytes(options_.folder).value_or(0);
      return end_recording(at, "only " + std::to_string(left >> 20) + " MiB are left on the disk");
    }
    const bool gone = ::access(path_.c_str(), F_OK) != 0;
    const bool over = file_.bytes() + chunk.bytes.size() > options_.part_bytes ||
                      newest_ns_ - part_began_ns_ >= options_.part.count();
    if (gone || (over && file_.bytes() > 0)) {
      if (gone) notice(at, Severity::kError, path_ + " was removed while it was written; a new part is begun");
      bytes_before_ += file_.bytes();
      (void)file_.close();
      mark_.renew();
      ++head_.part;
      if (!open_part(newest_ns_)) return end_recording(at, std::strerror(errno));
    }
  }
  if (!file_.append(chunk)) end_recording(at, std::strerror(file_.error()));
  mark_.renew();
}

/// Deletes the oldest recordings where the folder or the disk is too full. @return whether the disk has room then.
bool Recorder::room_for_more(Time at) {
  constexpr std::uint64_t kShareOfDisk = 10;  // of a small one less has to stay free
  const std::uint64_t least =
      std::min(options_.least_free_bytes, disk_bytes(options_.folder).value_or(UINT64_MAX) / kShareOfDisk);
  const auto before = free_bytes(options_.folder);
  std::uint64_t used = 0;
  if (before && *before < least) {
    for (const FileOfFolder& file : files_in(options_.folder)) used += file.bytes;
    const std::uint64_t missing = least - *before;
    for (const std::string& deleted : make_room(options_.folder, used > missing ? used - missing : 0))
      notice(at, Severity::kWarning, "deleted, as the disk is full: " + deleted);
  }
  const auto free = free_bytes(options_.folder);
  const std::scoped_lock lock(mutex_);
  status_.free_bytes = free.value_or(0);
  return !free || *free >= least;
}

bool Recorder::open_part(std::int64_t at_ns) {
  const bool own_name = options_.file.empty();
  if (own_name) {
    if (!make_folder(options_.folder)) return false;
    if (!room_for_more(time_at(at_ns))) {
      errno = ENOSPC;
      return false;
    }
    path_ = open_new(file_, options_.folder + "/" + part_name(head_, head_.part));
    if (path_.empty()) return false;
  } else {
    path_ = options_.file + kUnfinished;
    if (!make_folder(std::filesystem::absolute(path_).parent_path().string())) return false;
    (void)std::remove(path_.c_str());
    if (!file_.open(path_, topics())) {
      errno = file_.error();
      return false;
    }
  }
  bool written = file_.note(metadata_of(head_));
  for (const mcap::Attachment& attachment : attachments_of(head_)) written = written && file_.attach(attachment);
  if (!written) {
    errno = file_.error();
    return false;
  }
  part_began_ns_ = at_ns;
  recording_ = true;
  {
    const std::scoped_lock lock(mutex_);
    status_.recording = true;
    status_.file = own_name ? path_ : options_.file;
  }
  if (!own_name) return true;
  mark_ = NewestMark(path_);
  for (const std::string& deleted : make_room(options_.folder, options_.folder_bytes))
    notice(time_at(at_ns), Severity::kInfo, "deleted, as the folder is full: " + deleted);
  return true;
}

void Recorder::end_recording(Time at, const std::string& why) {
  recording_ = false;
  const std::string problem = options_.file.empty() ? why : why + "; what was recorded until then is in " + path_;
  if (file_.is_open()) {  // often there is room for a line where there was none for the rest
    const auto unix_ns = static_cast<std::uint64_t>(head_.started_unix_ns + at.time_since_epoch().count());
    builder_.add(
        channel_of(Topic::kEvents), sequences_[static_cast<std::size_t>(Topic::kEvents)]++, unix_ns, unix_ns,
        encode_log({at, Severity::kError, "recorder", "the recording has ended: " + problem}, head_.started_unix_ns));
    (void)file_.append(builder_.finish(options_.compression, {}));
    file_.abandon();
    mark_.renew();
  }
  {
    const std::scoped_lock lock(mutex_);
    status_.recording = false;
    status_.problem = problem;
  }
  say(at, Severity::kError, "the recording has ended: " + problem);
}

/// A file that was named is there only once it is complete.
bool Recorder::put_in_place(bool replaces) {
  if (!file_.close()) {
    errno = file_.error();
    return false;
  }
  mark_.renew();
  if (options_.file.empty()) return true;
  if (replaces || !std::filesystem::is_regular_file(options_.file))
    return std::rename((options_.file + kUnfinished).c_str(), options_.file.c_str()) == 0;
  const std::scoped_lock lock(mutex_);
  status_.file = options_.file + kUnfinished;
  return true;
}

void Recorder::close(bool replaces) {
  if (std::exchange(closed_, true)) return;
  drain();
  take_posted();
  if (!builder_.empty()) finish_chunk();
  flights_.close();
  take_posted();  // what the last flight record has to say of itself
  if (!builder_.empty()) finish_chunk();
  if (recording_ && !put_in_place(replaces)) end_recording(time_at(newest_ns_), std::strerror(errno));
  recording_ = false;
  drain();
}

RecorderThread::RecorderThread(Recorder& recorder)
    : thread_([&recorder](const std::stop_token& stop) {
        while (!stop.stop_requested()) {
          recorder.drain();
          std::this_thread::sleep_for(kDrainPeriod);
        }
      }) {}

RecorderThread::~RecorderThread() {
  thread_.request_stop();
  thread_.join();
}

}  // namespace knuckle::recording
