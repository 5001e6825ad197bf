#include "app/programs/program_options.h"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <exception>

#include "app/programs/program_console.h"
#include "core/error.h"
#include "machine/reason_text.h"

namespace knuckle::programs {

namespace {

cli::Json percentiles_json(const Histogram& h, double units_per_s) {
  const auto in_units = [units_per_s](Duration d) { return units_per_s * to_seconds(d); };
  return {{"p50", in_units(h.quantile(0.5))}, {"p99", in_units(h.quantile(0.99))}, {"max", in_units(h.max())}};
}

}  // namespace

AskedOutput::Open::Open(const char* option, const std::string& target)
    : file(option, target), writer(file.descriptor()) {
  if (isatty(file.descriptor()) == 1) on_terminal.emplace(writer.stream());
}

AskedOutput::AskedOutput(const char* option, const std::string& target, Content content)
    : name_(std::string(option) + " " + target), content_(content) {
  if (!target.empty()) open_.emplace(option, target);
}

std::string AskedOutput::tend() {
  if (!open_) return "";
  open_->writer.stream().flush();
  const int error = told_ ? 0 : open_->writer.refusal();
  if (error == 0) return "";
  told_ = true;
  return open_->file.refusal(error) + ": what was written before is kept, the rest is lost";
}

void AskedOutput::finish(cli::BackgroundWriter::Deadline deadline) {
  if (open_) open_->writer.finish(deadline);
}

void AskedOutput::commit(cli::BackgroundWriter::Deadline deadline) {
  if (!open_) return;
  open_->writer.finish(deadline);
  if (const int error = open_->writer.refusal(); error != 0) {
    if (content_ == Content::kRecords) open_->file.commit_whole_lines();
    return open_->file.check(error);
  }
  if (content_ == Content::kResult && records_lost() > 0)
    throw InputError(name_ + ": cannot be written: no reader took it in time");
  open_->file.commit();
}

std::uint64_t finish_records(ProgramConsole& console, const std::vector<AskedOutput*>& outputs) {
  const auto deadline = std::chrono::steady_clock::now() + cli::kReaderPatience;
  std::uint64_t lost = 0;
  for (AskedOutput* output : outputs) {
    output->finish(deadline);
    const std::uint64_t missing = output->records_lost();
    if (missing > 0) console.note(output->name() + ": " + std::to_string(missing) + " records are missing");
    lost += missing;
  }
  return lost;
}

void commit_all(const std::vector<AskedOutput*>& outputs) {
  const auto deadline = std::chrono::steady_clock::now() + cli::kReaderPatience;
  std::exception_ptr refused;
  for (AskedOutput* output : outputs) {
    try {
      output->commit(deadline);
    } catch (const InputError&) {
      if (!refused) refused = std::current_exception();
    }
  }
  if (refused) std::rethrow_exception(refused);
}

cli::Json loop_json(const RealtimeReport& report) {
  return {{"policy", report.policy},
          {"wake_us", percentiles_json(report.wake_lateness, 1e6)},
          {"execution_us", percentiles_json(report.execution, 1e6)},
          {"overruns", report.overruns}};
}

cli::Json counters_json(const CanCounters& c) {
  return {{"sent", c.sent},
          {"received", c.received},
          {"queue_full", c.queue_full},
          {"not_sendable", c.not_sendable},
          {"overflows", c.overflows},
          {"controller_overflows", c.controller_overflows},
          {"error_frames", c.error_frames},
          {"protocol_errors", c.protocol_errors},
          {"no_acknowledge", c.no_acknowledge},
          {"passive", c.passive},
          {"bus_off", c.bus_off},
          {"restarts", c.restarts},
          {"downs", c.downs},
          {"transmit_errors", c.transmit_errors},
          {"receive_errors", c.receive_errors}};
}

cli::Json milliseconds_json(const Histogram& histogram) {
  if (histogram.count() == 0) return nullptr;
  return percentiles_json(histogram, 1e3);
}

cli::Json reason_json(const Reason& reason, const BusDescription& bus) {
  if (!reason) return nullptr;
  return {{"code", name(reason.code)}, {"reason", text(reason, bus)}};
}

cli::Json readings_json(const MachineReadings& readings) {
  cli::Json json = cli::Json::object();
  MachineReadings::fields(readings, [&](const char* name, double value) { json[name] = value; });
  return json;
}

namespace {

constexpr std::size_t kLongestLine = 256, kAtOnce = 256;

std::string obey(const std::string& line, pairing::ChosenLink& link, const std::function<std::string()>& home) {
  if (line == "release") return link.release();
  if (line == "grant") return link.grant();
  if (line == "take") return link.take_control();
  if (line == "home") return home();
  return "unknown line: release gives control up, grant gives it to who asked last, take asks for it again; home goes "
         "on without a failed cylinder's pressures, where that is offered";
}

}  // namespace

std::vector<std::string> ControlInput::lines() {
  std::vector<std::string> lines;
  if (ended_ || (isatty(descriptor_) == 1 && tcgetpgrp(descriptor_) != getpgrp())) return lines;
  pollfd ready{descriptor_, POLLIN, 0};
  if (poll(&ready, 1, 0) <= 0) return lines;
  std::array<char, kAtOnce> part;
  const ssize_t count = ::read(descriptor_, part.data(), part.size());
  ended_ = count <= 0;
  for (ssize_t i = 0; i < count; ++i) {
    const char c = part[static_cast<std::size_t>(i)];
    if (c == '\n') {
      lines.push_back(std::move(text_));
      text_.clear();
    } else if (text_.size() < kLongestLine) {
      text_ += c;
    }
  }
  return lines;
}

std::vector<cli::News> obey_control_lines(ControlInput& input, pairing::ChosenLink& link,
                                          const std::function<std::string()>& home) {
  std::vector<cli::News> done;
  for (const std::string& line : input.lines()) {
    if (!line.empty()) done.push_back({obey(line, link, home), "typed"});
  }
  return done;
}

cli::Json path_json(const pairing::ChosenLink& link, std::chrono::steady_clock::time_point started) {
  const ice::Dialler* dialler = link.dialler();
  if (dialler == nullptr) return nullptr;
  cli::Json pairs = cli::Json::array();
  for (const ice::PathEvent& one : dialler->pairs()) {
    pairs.push_back({{"at_s", std::chrono::duration<double>(one.at - started).count()},
                     {"far_end", one.far_end},
                     {"kind", ice::name(one.pair.kind)},
                     {"local", text(one.pair.local)},
                     {"remote", text(one.pair.remote)},
                     {"round_trip_ms", std::chrono::duration<double, std::milli>(one.round_trip).count()}});
  }
  return {{"pairs", std::move(pairs)}, {"round_trip_ms", milliseconds_json(dialler->round_trips())}};
}

}  // namespace knuckle::programs
