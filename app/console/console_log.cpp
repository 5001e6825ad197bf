#include "app/console/console_log.h"

#include <utility>

#include "app/programs/program_console.h"
#include "app/session/session_setup.h"
#include "core/error.h"

namespace knuckle::console {
namespace {

recording::Severity severity_of(Severity severity) {
  switch (severity) {
    case Severity::kInfo:
      return recording::Severity::kInfo;
    case Severity::kWarning:
      return recording::Severity::kWarning;
    case Severity::kAlarm:
      return recording::Severity::kError;
  }
  return recording::Severity::kUnknown;
}

}  // namespace

recording::Head head_of(const session::SessionSetup& setup, const session::SimulateOptions& options,
                        const LogChoice& choice) {
  recording::Head head = session::session_head(setup, options);
  head.program = choice.program + " --scenario " + options.scenario + " --seed " + std::to_string(setup.seed);
  head.virtual_time = false;
  head.started_unix_ns = static_cast<std::int64_t>(1e9 * programs::unix_time_s());
  head.far_end_is_this_machine = false;
  return head;
}

recording::Head head_of(const StationSetup& setup, std::int64_t unix_ns, const LogChoice& choice) {
  return session::operator_head(choice.program, unix_ns, setup.side.machine, setup.side.device, setup.side.law,
                                setup.side.start);
}

recording::Recorder* ConsoleLog::make(const recording::Head& head, const MachineDescription& machine) {
  next_ = {};
  try {
    next_.log = std::make_unique<recordings::ProgramLog>(choice_.options, choice_.real, head, machine);
  } catch (const InputError& error) {
    if (run_ == 0) throw;
    next_.refused = error.what();
    return nullptr;
  }
  if (begun_) next_.log->begin();
  return next_.log->recorder();
}

void ConsoleLog::take_over(std::uint32_t run) {
  if (current_.log) current_.log->close();
  take_news();
  current_ = std::exchange(next_, {});
  run_ = run;
  if (!current_.refused.empty()) news_.push_back({"this session is not recorded: " + current_.refused, "recording"});
}

void ConsoleLog::drain() {
  if (!begun_ && current_.log && current_.log->recorder() != nullptr) current_.log->recorder()->drain();
}

void ConsoleLog::begin() {
  begun_ = true;
  if (current_.log) current_.log->begin();
}

void ConsoleLog::close() {
  for (OfSession* session : {&current_, &next_}) {
    if (session->log) session->log->close();
  }
}

recording::Recorder* ConsoleLog::recorder_of(std::uint32_t run) const {
  const OfSession& session = run > run_ ? next_ : current_;
  return run < run_ || !session.log ? nullptr : session.log->recorder();
}

void ConsoleLog::note(const EventRow& row) {
  if (recording::Recorder* recorder = recorder_of(row.run))
    recorder->event({row.at, severity_of(row.severity), row.code, row.text});
}

void ConsoleLog::note(std::uint32_t run, const recording::CameraStamp& stamp) {
  if (recording::Recorder* recorder = recorder_of(run)) recorder->camera(stamp);
}

void ConsoleLog::note(std::uint32_t run, const recording::CameraPicture& picture) {
  if (recording::Recorder* recorder = recorder_of(run)) recorder->camera(picture);
}

RecordingLight ConsoleLog::light() const {
  RecordingLight light;
  light.real = choice_.real;
  light.why = current_.log ? current_.log->problem() : current_.refused;
  if (!light.why.empty())
    light.state = RecordingLight::State::kStopped;
  else if (current_.log && current_.log->kept())
    light.state = RecordingLight::State::kOn;
  if (!current_.log || current_.log->recorder() == nullptr) return light;
  const recording::RecorderStatus status = current_.log->recorder()->status();
  light.free_bytes = status.free_bytes;
  light.steps_lost = status.steps_lost;
  return light;
}

void ConsoleLog::take_news() {
  for (OfSession* session : {&current_, &next_}) {
    if (!session->log) continue;
    for (cli::News& news : session->log->news()) news_.push_back(std::move(news));
  }
}

std::vector<cli::News> ConsoleLog::news() {
  take_news();
  return std::exchange(news_, {});
}

std::vector<std::string> ConsoleLog::notes() const {
  return current_.log ? current_.log->notes() : std::vector<std::string>{};
}

cli::Json ConsoleLog::json() const {
  return current_.log ? current_.log->json() : cli::Json();
}

PictureLog::PictureLog(double per_s) : period_(per_s > 0 ? from_seconds(1 / per_s) : Duration::zero()) {
  if (per_s > 0) video::JpegEncoder{};  // whether there can be pictures is said at the start
}

void PictureLog::show(std::uint32_t run, const recording::CameraStamp& stamp, const video::Frame& frame) {
  if (period_ == Duration::zero()) return;
  auto& camera = cameras_[stamp.camera];
  if (!camera) camera = std::make_unique<Camera>();
  const bool due = camera->last == kNever || frame.received - camera->last >= period_;
  const bool paused = camera->last != kNever && stamp.at == camera->next.picture.at;  // time stands still
  if (!due || paused || !camera->encoder.free()) return;
  camera->last = frame.received;
  camera->next = {run, {stamp.at, stamp.camera, {}}};
  camera->encoder.give(frame);
}

std::vector<PictureLog::Made> PictureLog::made() {
  std::vector<Made> all;
  for (auto& [name, camera] : cameras_) {
    camera->next.picture.jpeg = camera->encoder.take();
    if (!camera->next.picture.jpeg.empty()) all.push_back(camera->next);
  }
  return all;
}

std::vector<std::string> PictureLog::problems() {
  std::vector<std::string> all;
  for (auto& [name, camera] : cameras_) {
    const std::string problem = camera->encoder.problem();
    if (!problem.empty()) all.push_back("camera " + name + ": no picture is recorded any more: " + problem);
  }
  return all;
}

}  // namespace knuckle::console
