#include "app/recordings/program_log.h"

#include <cstdlib>
#include <string_view>

#include "app/cli/command.h"
#include "core/error.h"
#include "machine/description.h"
#include "recording/file_names.h"

namespace knuckle::recordings {

void add_log_options(const cli::OptionList& command, LogOptions& options, const std::string& without_log) {
  command.add_option("--log", options.folder,
                     "Folder for what is recorded (default: ~/.local/state/knuckle/recordings)");
  command.add_flag("--no-log", options.off, without_log);
}

void check_log(const LogOptions& options) {
  if (options.off && !options.folder.empty())
    cli::refuse_option("--no-log", "", "does not go with --log " + options.folder);
}

namespace {

/// Of a folder that no option named.
std::string refusal_without_option(std::string refusal) {
  const std::string_view option = "--log ";
  if (refusal.starts_with(option)) refusal.erase(0, option.size());
  const char* const variable = std::getenv("KNUCKLE_RECORDINGS");
  return (variable != nullptr && *variable != '\0' ? "KNUCKLE_RECORDINGS=" : "") + refusal;
}

}  // namespace

ProgramLog::ProgramLog(const LogOptions& options, bool real, recording::Head head, const MachineDescription& machine)
    : kept_(!options.off && (real || !options.folder.empty())),
      folder_(options.folder.empty() ? recording::default_folder() : options.folder) {
  if (!real && options.folder.empty()) return;
  recording::RecorderOptions how;
  how.folder = folder_;
  how.keep = kept_;
  try {
    recorder_ = std::make_unique<recording::Recorder>(how, head, machine);
  } catch (const InputError& error) {
    if (!options.folder.empty()) throw;
    failure_ = refusal_without_option(error.what());
    kept_ = how.keep = false;
    recorder_ = std::make_unique<recording::Recorder>(how, head, machine);
  }
}

void ProgramLog::begin() {
  if (recorder_ && !thread_) thread_ = std::make_unique<recording::RecorderThread>(*recorder_);
}

ProgramLog::~ProgramLog() {
  close();
}

std::string ProgramLog::problem() const {
  if (!failure_.empty() || !recorder_) return failure_;
  return recorder_->status().problem;
}

std::vector<std::string> ProgramLog::notes() const {
  if (!failure_.empty()) return {"NOT RECORDED: " + failure_};
  if (kept_) return {"recording to " + recorder_->status().file};
  if (recorder_) return {"NOT RECORDED (--no-log); flight records of faults and stops go to " + folder_};
  return {};
}

std::vector<cli::News> ProgramLog::news() {
  if (!recorder_) return {};
  const recording::RecorderStatus status = recorder_->status();
  std::vector<cli::News> news;
  for (; flights_told_ < status.flights.size(); ++flights_told_)
    news.push_back(
        {"flight record " + status.flights[flights_told_] + ": read it with knuckle explain", "flight record"});
  for (; notices_told_ < status.notices.size(); ++notices_told_)
    news.push_back({status.notices[notices_told_], "recording"});
  if (status.problem != problem_told_) {
    problem_told_ = status.problem;
    news.push_back({"the recording has ended: " + status.problem, "recording"});
  }
  return news;
}

void ProgramLog::close() {
  thread_.reset();
  if (recorder_) recorder_->close();
}

cli::Json ProgramLog::json() const {
  if (!recorder_) return nullptr;
  const recording::RecorderStatus status = recorder_->status();
  return {{"file", kept_ ? cli::Json(status.file) : cli::Json()},
          {"bytes", status.bytes},
          {"problem", status.problem.empty() ? cli::Json() : cli::Json(status.problem)},
          {"steps_lost", status.steps_lost},
          {"flight_records", status.flights},
          {"notices", status.notices}};
}

}  // namespace knuckle::recordings
