#include "app/identify/identify.h"

#include <algorithm>
#include <iostream>
#include <stdexcept>
#include <type_traits>

#include "app/cli/interrupt.h"
#include "app/cli/output_file.h"
#include "app/cli/terminal.h"
#include "app/identify/data_check.h"
#include "app/identify/ensemble.h"
#include "app/identify/identify_output.h"
#include "core/error.h"
#include "estimation/identification/baseline.h"
#include "estimation/identification/static_poses.h"
#include "machine/load.h"

namespace knuckle::identify {
namespace {

using estimation::Recording;
using estimation::TorqueComparison;

/// What a method answers with, whichever it is.
struct MethodRun {
  estimation::Identification summary;
  std::optional<DynamicsCalibration> dynamics;
  std::function<TorqueComparison(const Recording&)> compare;
  std::function<void(const Recording&, HoldOut&)> find_tip_force = [](const Recording&, HoldOut&) {};
};

template <typename Result>
MethodRun baseline(const Result& result, const MachineDescription& machine) {
  return {result.summary,
          {},
          [=](const Recording& recording) { return compare_torque(result, machine, recording); },
          [=](const Recording& recording, HoldOut& held) {
            held.tip_force_N = force_rms_N(external_force(result, machine, recording));
            if constexpr (std::is_same_v<Result, estimation::KimResult>)
              held.tip_wrench_N = force_rms_N(external_wrench(result, machine, recording));
          }};
}

MethodRun run_paper(Paper paper, const MachineDescription& machine, const std::vector<Recording>& recordings) {
  if (paper == Paper::kMalaguti) return baseline(estimation::identify_malaguti(machine, recordings), machine);
  if (paper == Paper::kKim) return baseline(estimation::identify_kim(machine, recordings), machine);
  return baseline(estimation::identify_static(machine, recordings, estimation::all_measured_links(machine)), machine);
}

MethodRun run_full(const MachineDescription& machine, const std::vector<Recording>& recordings,
                   const estimation::FullOptions& options) {
  const estimation::FullResult result = estimation::identify_full(machine, recordings, options);
  MethodRun run{result.summary, result.dynamics, {}};
  run.compare = [=, dynamics = result.dynamics](const Recording& recording) {
    return estimation::compare_torque(dynamics, machine, recording, options);
  };
  return run;
}

void validate(const IdentifyData& data, const MethodRun& run, const std::string& method, Identified& result) {
  for (const Recording& recording : data.hold_out) {
    const TorqueComparison comparison = run.compare(recording);
    result.hold_out.push_back(held_out(recording.source, method, comparison));
    run.find_tip_force(recording, result.hold_out.back());
    if (method == result.method) result.comparisons.push_back(comparison);
  }
}

/// Held-out torque that is not explained, or not there, makes a result unusable, whatever its own residuals say.
void judge(Identified& result) {
  if (!result.summary.usable) return;
  std::vector<HoldOut> own = result.hold_out;  // the papers' methods are there to compare with
  std::erase_if(own, [&](const HoldOut& held) { return held.method != result.method; });
  PerJoint<bool> must_be_judged{};
  for (int j = 0; j < kJoints; ++j)
    must_be_judged[static_cast<std::size_t>(j)] =
        result.method == "full" && j != result.machine.sensors.without_pressures;
  std::vector<std::string> reasons = objections(own, must_be_judged);
  if (reasons.empty()) return;
  result.summary.usable = false;
  result.summary.reasons = std::move(reasons);
}

/// Reasons why a result is not usable come before whatever else is to be known of it.
void tell(const TimeSkew& skew, estimation::Identification& summary) {
  summary.reasons.insert(skew.refuses ? summary.reasons.begin() : summary.reasons.end(), skew.what);
  summary.usable = summary.usable && !skew.refuses;
}

/// 0 where nobody measures the torque.
JointVector pooled_rms(const Identified& result) {
  JointVector sum = JointVector::Zero();
  double count = 0;
  for (const HoldOut& held : result.hold_out) {
    JointVector rms_Nm = held.to_2Hz.rms_Nm;
    if (const int without = result.machine.sensors.without_pressures; without != SensorDescription::kNone)
      rms_Nm[without] = 0;
    if (held.method != result.method || !rms_Nm.allFinite()) continue;
    sum += rms_Nm.cwiseAbs2();
    ++count;
  }
  return count > 0 ? JointVector((sum / count).cwiseSqrt()) : JointVector(JointVector::Zero());
}

/// The machine before anything was learned of it.
MachineDescription drawing_of(MachineDescription machine) {
  machine.geometry_calibration.reset();
  machine.dynamics_calibration.reset();
  machine.valve_calibration = {};
  return machine;
}

/// Of machines sampled around the same nominal one: commissioned alike, surveyed where this one's geometry is
/// calibrated.
CalibrationMatrix ensemble_error(const IdentifyOptions& options, const MachineDescription& machine,
                                 const std::function<void(double)>& progress) {
  const bool surveyed = machine.geometry_calibration.has_value();
  CommissionPlan plan = commission_plan(options);
  if (!surveyed) plan.survey_poses = 0;
  return model_error(drawing_of(machine), plan, surveyed, options.ensemble, options.seed, 0, progress);
}

/// The full method's own report, or the paper's tables and figures again.
void write_page(const IdentifyOptions& options, const IdentifyData& data, const Identified& result, std::ostream& out) {
  const auto paper = paper_named(options.method);
  if (!paper) return write_identify_report(data, result, out);
  write_baseline_report(*paper, calibrated(data.machine),
                        {data.training, data.hold_out, data.truth, result.bias, result.summary}, out);
}

/// What the paper's method needs, before anything is driven or read.
void require_signals(const IdentifyOptions& options) {
  const auto paper = paper_named(options.method);
  if (!paper) return;
  const MachineDescription machine = load_machine(find_config("machine", options.machine));
  const std::string missing = missing_for(*paper, machine);
  if (missing.empty()) return;
  throw InputError(machine.source + ": key 'sensors.without_pressures' = \"" +
                   kJointNames[static_cast<std::size_t>(machine.sensors.without_pressures)] + "\": --method " +
                   name(*paper) + " needs " + missing + "; full does without one of them");
}

/// For the page of kMalaguti; of other machines than the one surveyed, so all nominal.
std::vector<InertiaBias> inertia_bias(const IdentifyOptions& options, const IdentifyData& data,
                                      const std::function<void(double)>& progress) {
  constexpr int kMachines = 10;
  if (!options.simulate || paper_named(options.method) != Paper::kMalaguti || options.report.empty()) return {};
  return malaguti_bias(drawing_of(data.machine), options.seed, kMachines, progress);
}

}  // namespace

Identified identify(const IdentifyData& given, std::optional<Paper> paper, const estimation::FullOptions& options,
                    const std::function<void(double)>& progress) {
  const auto done = [&](double share) {
    if (progress) progress(share);
  };
  done(0);
  Identified result;
  result.method = paper ? name(*paper) : "full";
  result.machine = given.machine;
  const MachineDescription machine = calibrated(given.machine);
  IdentifyData data = given;
  const TimeSkew skew = paper ? TimeSkew{} : take_off_skew(machine, data);
  done(0.3);
  const MethodRun run = paper ? run_paper(*paper, machine, data.training) : run_full(machine, data.training, options);
  result.summary = run.summary;
  done(0.6);
  const bool solved = !run.summary.parameters.empty();
  if (solved) validate(data, run, result.method, result);
  judge(result);
  if (!skew.what.empty()) tell(skew, result.summary);
  if (!paper) {
    const CalibrationVector drawn = estimation::drawn_parameters(machine);
    result.nominal = {drawn.begin(), drawn.end()};
    result.machine.dynamics_calibration = run.dynamics;
    result.machine.dynamics_calibration->residual_rms_Nm = pooled_rms(result);
    for (const Paper other_paper : {Paper::kMalaguti, Paper::kKim}) {
      if (!missing_for(other_paper, machine).empty()) continue;
      const MethodRun other = run_paper(other_paper, machine, data.training);
      if (solved && other.summary.usable) validate(data, other, name(other_paper), result);
    }
    done(0.8);
    const auto commanded = [](const Recording& recording) { return !recording.valve.empty(); };
    // A commanded speed tells nothing of the valve behind it.
    const bool tells_opening = machine.bus.command_kind != CommandKind::kJointRate;
    if (tells_opening && result.summary.usable && std::all_of(data.training.begin(), data.training.end(), commanded))
      result.valves = learn_valves(result.machine, data.training);
  }
  result.machine.calibration_provenance = {result.method, cli::now_utc(), data.sha256, data.source,
                                           cli::program_version()};
  done(1);
  return result;
}

int identify_command(const IdentifyOptions& options) {
  const cli::InterruptGuard interrupt;
  cli::OptionalOutput out("--out", options.out), json("--json", options.json);
  if (!options.report.empty()) report::check_gnuplot();
  cli::OptionalOutput report("--report", options.report);
  require_signals(options);
  IdentifyData data;
  Identified result;
  try {
    data = !options.simulate ? read_data(options) : cli::watched(interrupt, "commissioning", [&](const auto& progress) {
      return drive_for_data(options, progress);
    });
    estimation::FullOptions full;
    if (options.ensemble > 0) {
      full.model_error = cli::watched(
          interrupt, "ensemble", [&](const auto& progress) { return ensemble_error(options, data.machine, progress); });
    }
    result = cli::watched(interrupt, "identify", [&](const auto& progress) {
      return identify(data, paper_named(options.method), full, progress);
    });
    result.bias = cli::watched(interrupt, "inertias",
                               [&](const auto& progress) { return inertia_bias(options, data, progress); });
  } catch (const InputError&) {
    throw;
  } catch (const std::runtime_error& stopped) {  // the machine did not engage or dropped out
    std::cerr << "knuckle: not identified: " << stopped.what() << '\n';
    return 1;
  }
  std::ostream& told = cli::is_standard_output(options.json) || cli::is_standard_output(options.report) ||
                               cli::is_standard_output(options.out)
                           ? std::cerr
                           : std::cout;
  told << identify_summary(data, result);
  if (out && result.summary.usable) {
    const std::string kept = write_calibrated_machine(result.machine, *out);
    told << "  written: " << options.out << (kept.empty() ? "" : ", the older one kept as " + kept) << '\n';
  } else if (out) {
    told << "  " << options.out << " not written: not usable\n";
  }
  json.write([&](std::ostream& to) { write_identify_json(data, result, to); });
  report.write([&](std::ostream& to) { write_page(options, data, result, to); });
  if (report) told << "  report: " << options.report << '\n';
  return result.summary.usable ? 0 : 1;
}

}  // namespace knuckle::identify
