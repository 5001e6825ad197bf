#include "app/console/screens/kept_of_run.h"

#include <algorithm>
#include <iterator>
#include <optional>

#include "app/console/player/link_feed.h"
#include "app/console/player/rows.h"
#include "app/console/screens/console_data.h"

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
    : payload_(kLeastLoad * machine.payload_full_scale_kg) {
  PayloadTotal total = payload_;
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
    payload_ = load->total;
  else
    payload_.clear();
  show_contacts(at);
  show_link(at);
}

void KeptOfRun::show_contacts(Time at) {
  contacts_.clear();
  const auto end = player::first_after(touches_, at);
  if (end == touches_.begin()) return;
  // The last contact is remembered though its points have faded.
  const auto begin = std::min(player::first_from(touches_, at - ContactTrail::kKept), std::prev(end));
  std::for_each(begin, end, [this](const ContactTrail::Touch& touch) { contacts_.add(touch); });
}

/// On from where it was, or anew where the time has gone back.
void KeptOfRun::show_link(Time at) {
  const bool anew = link_at_ == kNever || at < link_at_;
  if (anew) link_ = {};
  const auto end = player::first_after(looks_, at);
  for (auto look = player::first_after(looks_, anew ? at - LinkHistory::kKept : link_at_); look != end; ++look) {
    link_.pass(look->at);
    link_.add(look->values);
  }
  link_.pass(at);
  link_at_ = at;
}

}  // namespace knuckle::console::screens
