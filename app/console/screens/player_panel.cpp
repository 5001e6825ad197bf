#include "app/console/screens/player_panel.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "app/console/player/run_data.h"

namespace knuckle::console::screens {
namespace {

constexpr Duration kLook = 20ms;       // a frame of a window
constexpr Duration kGathered = 200ms;  // how often the console gathers the link's histograms

/// The link as the console saw it, look by look.
class LinkLooks {
 public:
  explicit LinkLooks(const player::Run& run) : run_(run) {}

  /// @param link of the run at this time, which is later than that of the call before.
  [[nodiscard]] std::optional<LinkValues> at(Time at, LinkSide link) {
    if (const auto from = run_.counted_from(at); from != from_) {
      from_ = from;
      gathered_ = {};
      feed_.reset();
      if (from) feed_.emplace(run_.data(), *from);
    }
    if (at - gathered_at_ >= kGathered) {
      gathered_at_ = at;
      if (feed_) {
        feed_->pass(at);
        feed_->show(gathered_);
      }
    }
    if (!feed_) return std::nullopt;
    link.round_trip = gathered_.round_trip;
    link.arrival_jitter = gathered_.arrival_jitter;
    link.loss = gathered_.loss;
    return link_values(link);
  }

 private:
  const player::Run& run_;
  std::optional<player::LinkFeed> feed_;
  std::optional<Time> from_;
  Time gathered_at_ = kNever;
  LinkSide gathered_;
};

}  // namespace

KeptOfRun::KeptOfRun(const player::Run& run, const MachineDescription& machine, const Kinematics& kinematics)
    : kept_(machine) {
  PayloadTotal total = kept_.payload;
  ContactTrail trail;
  LinkLooks link(run);
  const double reach = reach_m(machine);
  for (Time at = run.first(); at <= run.last(); at += kLook) {
    const ConsoleView view = run.view(at);
    if (const auto values = link.at(at, view.link)) looks_.push_back({at, *values});
    if (run.machine_at(at) == nullptr || measured_freshness(view).stale()) continue;
    total.watch(view.machine, at);
    if (total.loads() != (loads_.empty() ? 0 : loads_.back().total.loads())) loads_.push_back({at, total});
    if (const auto touch = trail.watch(view, kinematics, reach)) touches_.push_back(*touch);
  }
}

void KeptOfRun::show(Time at) {
  const Load* const load = player::newest(loads_, at);
  if (load != nullptr)
    kept_.payload = load->total;
  else
    kept_.payload.clear();
  show_contacts(at);
  show_link(at);
}

void KeptOfRun::show_contacts(Time at) {
  kept_.contacts.clear();
  const auto end = player::first_after(touches_, at);
  if (end == touches_.begin()) return;
  // The last contact is remembered though its points have faded.
  const auto begin = std::min(player::first_from(touches_, at - ContactTrail::kKept), std::prev(end));
  std::for_each(begin, end, [this](const ContactTrail::Touch& touch) { kept_.contacts.add(touch); });
}

/// On from where it was, or anew where the time has gone back.
void KeptOfRun::show_link(Time at) {
  const bool anew = link_at_ == kNever || at < link_at_;
  if (anew) kept_.link = {};
  const auto end = player::first_after(looks_, at);
  for (auto look = player::first_after(looks_, anew ? at - LinkHistory::kKept : link_at_); look != end; ++look) {
    kept_.link.pass(look->at);
    kept_.link.add(look->values);
  }
  kept_.link.pass(at);
  link_at_ = at;
}

namespace {

constexpr std::size_t kMostEvents = 20'000;

}  // namespace

PlayerPanel::PlayerPanel(player::Played played, std::optional<Beside> beside)
    : played_(std::move(played)),
      beside_(std::move(beside)),
      kinematics_(played_.machine),
      timeline_(played_.run, played_.events),
      events_(kMostEvents),
      kept_(played_.run, played_.machine, kinematics_) {
  for (const EventRow& row : played_.events) events_.add(row.at, 1, row.severity, row.code, row.text);
  events_.acknowledge(EventFilter{});
  plots_.cursor().chosen = true;
  pass(0);
}

void PlayerPanel::pass(double seconds) {
  if (const auto clicked = plots_.clicked())
    timeline_.seek(*clicked);
  else
    timeline_.pass(seconds);
  const Time at = timeline_.cursor();
  if (shown_ == at) return;
  shown_ = at;
  view_ = played_.run.view(at);
  played_.run.show_link(at, view_.link);
  kept_.show(at);
  show_loads(at);
  if (beside_) {
    const Time there = at + beside_->later;
    beside_here_ = there >= beside_->run.first() && there <= beside_->run.last();
    beside_view_ = beside_->run.view(there);
  }
  if (!plots_.show(at)) return;
  plots_.fill([&](std::int64_t step) { return sample(played_.run, History::time_of(step)); });
  if (beside_)
    plots_.fill_beside(beside_->name.c_str(), [&](std::int64_t step) {
      return sample(beside_->run, History::time_of(step) + beside_->later);
    });
}

void PlayerPanel::show_loads(Time at) {
  PushWatch watch;
  for (Time look = at - PushWatch::kLasts; look <= at; look += PushWatch::kLasts / 10) {
    loads_ = measured_loads(played_.run.view(look), played_.machine, kinematics_);
    watch.watch(loads_, look);
  }
}

History::Sample PlayerPanel::sample(const player::Run& run, Time at) const {
  if (!run.recorded(at)) return {};
  const ConsoleView view = run.view(at);
  return History::sample_of(view, !measured_freshness(view).stale(), !valves_freshness(view).stale());
}

bool PlayerPanel::in_gap() const noexcept {
  return !played_.run.recorded(timeline_.cursor());
}

}  // namespace knuckle::console::screens
