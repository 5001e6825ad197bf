#include "app/session/session_result.h"

#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstring>
#include <memory>
#include <string_view>
#include <utility>

#include "app/cli/digest.h"
#include "app/session/session_setup.h"
#include "app/session/truth_file.h"
#include "core/error.h"
#include "core/fields.h"
#include "machine/kinematics.h"
#include "recording/file_names.h"
#include "transport/timed_frame.h"

namespace knuckle::session {
namespace {

constexpr std::size_t kDigits = 16;

void append(std::string& bytes, const void* from, std::size_t size) {
  bytes.append(static_cast<const char*>(from), size);
}

std::string digest_of(std::string_view bytes) {
  cli::Digest digest;
  digest.add(bytes);
  return digest.finish();
}

/// Without padding: values only.
std::string bytes_of(const FrameLog& frames) {
  std::string bytes;
  for (const TimedFrame& timed : frames) {
    const std::int64_t at_ns = timed.at.time_since_epoch().count();
    append(bytes, &at_ns, sizeof at_ns);
    append(bytes, &timed.frame.id, sizeof timed.frame.id);
    append(bytes, &timed.frame.size, sizeof timed.frame.size);
    append(bytes, timed.frame.data.data(), timed.frame.data.size());
  }
  return bytes;
}

}  // namespace

SessionDigest digest_of(const std::vector<Sample>& rows, const FrameLog& frames) {
  SessionDigest session;
  std::string bytes, all;
  const auto add = [&](const std::string& field) {
    session.lines.push_back({field, digest_of(bytes).substr(0, kDigits)});
    all += field + ' ' + session.lines.back().digest + '\n';
    bytes.clear();
  };
  for (const Field& field : fields_of<Sample>()) {
    for (const Sample& row : rows) append(bytes, reinterpret_cast<const std::byte*>(&row) + field.offset, field.size);
    add(field.part.empty() ? field.name : field.part + "_" + field.name);
  }
  bytes = bytes_of(frames);
  add("frames");
  session.whole = digest_of(all);
  return session;
}

Percentiles percentiles_us(const Histogram& histogram) {
  const auto us = [](Duration d) { return 1e6 * to_seconds(d); };
  return {us(histogram.quantile(0.5)), us(histogram.quantile(0.99)), us(histogram.max())};
}

Judged judge(const SessionResult& session) {
  std::vector<Criterion> criteria = session.criteria;
  // A session whose record has gaps is not passed, whatever its criteria.
  if (session.record.records_lost > 0)
    criteria.insert(criteria.begin(), {"records_lost", {}, 0, CriterionKind::kSafety});
  Judged judged{session, compute_metrics(session.record), {}, {}};
  judged.criteria = evaluate(criteria, judged.metrics, session.record);
  const bool passed = all_passed(judged.criteria, session.requirements_decide);
  if (!passed || !session.record.cut_short) judged.passed = passed;
  return judged;
}

namespace {

void describe(const SessionSetup& setup, SessionResult& result) {
  result.scenario = setup.scenario.name;
  result.machine_name = setup.machine.name;
  result.device_name = setup.device.name;
  result.control = name(setup.law);
  result.seed = setup.seed;
  result.machine_seed = setup.machine_seed;
  result.delay_ms = 1e3 * to_seconds(setup.to_machine.delay);
  result.jitter_ms = 1e3 * to_seconds(setup.to_machine.jitter);
  result.loss = setup.to_machine.loss;
  result.bursts_per_s = setup.to_machine.bursts_per_s;
  result.criteria = setup.scenario.criteria;
  result.machine = setup.machine;
}

constexpr std::size_t kVirtualRing = std::size_t{1} << 18;  // drained many times a second of the session

/// Nothing where none is asked for.
std::unique_ptr<recording::Recorder> recorder_for(const SimulateOptions& options, const SessionSetup& setup) {
  if (options.log.empty() && options.flights.empty()) return nullptr;
  if (!options.flights.empty() && !recording::make_folder(options.flights))
    throw InputError("--flights " + options.flights + ": cannot be written: " + std::strerror(errno));
  recording::RecorderOptions how;
  how.file = options.log;
  how.folder = options.flights;
  how.keep = !options.log.empty();
  if (!options.realtime) how.ring_bytes = kVirtualRing;
  return std::make_unique<recording::Recorder>(how, session_head(setup, options), setup.machine);
}

SessionOutcome run_on_virtual_time(const SessionSetup& setup, recording::Recorder* recorder,
                                   const std::function<void(double)>& progress) {
  constexpr int kDrainTicks = 50;
  Session session(setup);
  if (recorder != nullptr) session.record_to(*recorder);
  for (int tick = 0; !session.done(); ++tick) {
    session.step();
    if (recorder != nullptr && tick % kDrainTicks == 0) recorder->drain();
    if (progress && tick % 2000 == 0) progress(session.done_fraction());
  }
  return session.take_outcome();
}

/// All criteria fail then, and none of them says why.
std::string unheard_text(const SessionSetup& setup) {
  std::string text = "no message of the operator's side arrived over the link";
  if (!setup.connect.empty()) text += ": --connect " + setup.connect + " does not lead to --listen " + setup.listen;
  return text;
}

}  // namespace

SessionResult run_simulation(const SimulateOptions& options, const SessionHooks& hooks) {
  SessionResult result;
  LoadedSession loaded = load_session(options);
  SessionSetup& setup = loaded.setup;
  if (options.realtime) setup.drawn_starts = {random_start(), random_start()};
  result.operator_name = loaded.operator_name;
  result.family = options.truth.empty() ? sim::name(family_named(options.family)) : "file";
  result.person = sim::name(person_named(options.person, setup.scenario.person));
  result.notes = std::move(loaded.notes);
  describe(setup, result);
  result.requirements_decide = options.judge || is_stock(options);
  result.impairment = options.impairment;
  const auto start = std::chrono::steady_clock::now();
  const std::unique_ptr<recording::Recorder> recorder = recorder_for(options, setup);
  const auto close_log = [&](bool complete) {
    if (!recorder) return;
    recorder->close(complete);
    result.log = recorder->status();
    if (hooks.recorded) hooks.recorded(result.log);
  };
  SessionOutcome outcome;
  try {
    outcome = options.realtime ? run_realtime(setup, recorder.get(), hooks.progress)
                               : run_on_virtual_time(setup, recorder.get(), hooks.progress);
  } catch (...) {
    close_log(false);
    throw;
  }
  close_log(true);
  if (recorder) {
    if (!result.log.problem.empty()) result.notes.push_back("the recording has ended: " + result.log.problem);
    for (const std::string& notice : result.log.notices) result.notes.push_back(notice);
    for (const std::string& file : result.log.flights) result.notes.push_back("flight record: " + file);
  }
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (hooks.progress) hooks.progress(1);
  result.simulated_s = outcome.elapsed_s;
  result.record = std::move(outcome.record);
  // A session in which nothing was heard has failed, however short it was.
  result.record.cut_short = loaded.shortened && outcome.heard && !result.record.plan_finished;
  result.hops = std::move(outcome.hops);
  if (!outcome.heard) result.notes.push_back(unheard_text(setup));
  result.loops = std::move(outcome.loops);
  result.digest = digest_of(result.record.samples, outcome.frames);
  result.scene = scene_of(setup.scenario.world, result.record, reach_m(setup.machine));
  if (hooks.candump != nullptr) {
    for (const TimedFrame& f : outcome.frames) *hooks.candump << candump_line(f.at, f.frame) << '\n';
  }
  return result;
}

}  // namespace knuckle::session
