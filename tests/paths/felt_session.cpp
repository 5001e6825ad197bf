#include "tests/paths/felt_session.h"

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

#include "app/console/operator_station.h"
#include "app/session/loop_views.h"
#include "app/session/session_setup.h"
#include "core/loop_table.h"
#include "core/realtime_thread.h"
#include "transport/link_session.h"

namespace knuckle::test {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kBefore_s = 1, kAfter_s = 12;

/// A step of the operator's side.
struct Row {
  double t_s = 0;
  Mode mode = Mode::kOff;
  bool enable = false, holding = false;
  double felt_N = 0, slew_N_per_ms = 0, silence_s = 0;
  PlanarVector on_bucket_N = PlanarVector::Zero();  ///< As the machine told it last.
  int changes = 0;
};

class Person {
 public:
  Person(Link& link, const session::SessionSetup& setup)
      : station_({.side = {.device = setup.device,
                           .machine = setup.machine,
                           .law = setup.law,
                           .start = random_start(),
                           .assist = {}},
                  .limb = setup.limb,
                  .hand_rad = setup.scenario.hand_rad,
                  .start_rad = setup.scenario.start_rad,
                  .seed = setup.seed},
                 link, nullptr),
        person_(session::operator_of(setup)) {
    rows_.reserve(static_cast<std::size_t>((setup.scenario.duration_s + 1) / to_seconds(kTick)));
  }
  void step(Time now, int changes) noexcept {
    const auto seen =
        session::person_view(session::view_of(now, station_.master()), station_.start_rad(), station_.hand(), 0);
    const sim::OperatorIntent intent = person_.step(now, seen);
    station_.step(now, intent);
    const master::MasterLoop& master = station_.master();
    const PlanarVector felt_N = master.sent_force_N();
    Row row{.t_s = to_seconds(now),
            .mode = master.machine() ? master.machine()->mode : Mode::kOff,
            .enable = intent.enable,
            .holding = person_.holding(),
            .felt_N = felt_N.norm(),
            .slew_N_per_ms = 0,
            .silence_s = master.silence_s(),
            .changes = changes};
    if (master.machine()) row.on_bucket_N = master.machine()->tip_force_N;
    if (!rows_.empty() && row.t_s > rows_.back().t_s)
      row.slew_N_per_ms = 1e-3 * (felt_N - last_felt_N_).norm() / (row.t_s - rows_.back().t_s);
    last_felt_N_ = felt_N;
    if (rows_.size() < rows_.capacity()) rows_.push_back(row);
    finished_ = person_.finished();
  }
  [[nodiscard]] bool finished() const noexcept { return finished_; }
  [[nodiscard]] const std::vector<Row>& rows() const noexcept { return rows_; }
  [[nodiscard]] bool timed_out() const noexcept { return person_.timed_out() >= 0 || !person_.finished(); }

 private:
  console::OperatorStation station_;
  sim::Operator person_;
  std::vector<Row> rows_;
  PlanarVector last_felt_N_ = PlanarVector::Zero();
  std::atomic<bool> finished_{false};
};

/// @param at the row in which it was noticed.
Json judge_change(const std::vector<Row>& rows, std::size_t at) {
  const Row& then = rows[at];
  double felt_N = 0, felt_most_N = 0, slew = 0, gap_s = 0, bucket_most_N = 0;
  PlanarVector bucket_N = PlanarVector::Zero();
  int before = 0;
  Json modes = Json::array();
  for (std::size_t i = at; i-- > 0 && rows[i].t_s > then.t_s - kBefore_s; ++before) {
    felt_N += rows[i].felt_N;
    bucket_N += rows[i].on_bucket_N;
  }
  felt_N /= std::max(before, 1);
  bucket_N /= std::max(before, 1);
  for (std::size_t i = at; i < rows.size() && rows[i].changes == then.changes; ++i) {
    const Row& row = rows[i];
    if (row.t_s > then.t_s + kAfter_s || row.holding != then.holding) break;
    slew = std::max(slew, row.slew_N_per_ms);
    felt_most_N = std::max(felt_most_N, row.felt_N);
    gap_s = std::max(gap_s, row.silence_s);
    bucket_most_N = std::max(bucket_most_N, row.on_bucket_N.norm());
    if (modes.empty() || modes.back() != name(row.mode)) modes.push_back(name(row.mode));
  }
  return {{"at_s", then.t_s},
          {"in_hold", then.holding},
          {"felt_before_N", felt_N},
          {"felt_rise_N", felt_most_N - felt_N},
          {"felt_slew_N_per_ms", slew},
          {"on_bucket_before_N", bucket_N.norm()},
          {"on_bucket_rise_N", bucket_most_N - bucket_N.norm()},
          {"longest_gap_ms", 1e3 * gap_s},
          {"modes", modes}};
}

Json judge(const Person& person) {
  const std::vector<Row>& rows = person.rows();
  Json json{{"engaged_s", Json()},
            {"phases_timed_out", person.timed_out() ? 1 : 0},
            {"resumed", 0},
            {"changes", Json::array()}};
  int resumed = 0;
  bool released = true;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const bool engages = rows[i].mode == Mode::kEngaged && rows[i - 1].mode != Mode::kEngaged;
    if (!rows[i].enable) released = true;
    if (engages) {
      if (json["engaged_s"].is_null()) json["engaged_s"] = rows[i].t_s;
      resumed += released ? 0 : 1;
      released = false;
    }
    if (rows[i].changes != rows[i - 1].changes) json["changes"].push_back(judge_change(rows, i));
  }
  json["resumed"] = resumed;
  return json;
}

}  // namespace

Json feel_session(Link& link, const std::string& scenario, const volatile std::sig_atomic_t& changes,
                  const volatile std::sig_atomic_t& ended) {
  session::SimulateOptions options;
  options.scenario = scenario;
  const session::LoadedSession loaded = session::load_session(options);
  Person person(link, loaded.setup);
  const RealtimeClock clock;
  {
    RealtimeThread thread({.name = "person", .period = kTick, .fifo_priority = fifo_priority::kMaster}, clock,
                          [&](Time now) { person.step(now, static_cast<int>(changes)); });
    while (!person.finished() && ended == 0 && to_seconds(clock.now()) < loaded.setup.scenario.duration_s)
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    thread.stop();
  }
  return judge(person);
}

}  // namespace knuckle::test
