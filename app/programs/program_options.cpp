#include "app/programs/program_options.h"

#include <unistd.h>

#include <chrono>
#include <exception>

#include "app/cli/json.h"
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

std::uint64_t finish_records(ProgramConsole& console, std::initializer_list<AskedOutput*> outputs) {
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

void commit_all(std::initializer_list<AskedOutput*> outputs) {
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

}  // namespace knuckle::programs
