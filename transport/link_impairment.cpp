#include "transport/link_impairment.h"

#include <algorithm>
#include <string>

#include "core/error.h"

namespace knuckle {
namespace {

void require(bool ok, const char* what) {
  if (!ok) throw InputError(std::string("link: ") + what);
}

void check_probability(const char* key, double value) {
  if (value >= 0 && value <= 1) return;
  throw InputError(std::string("link: ") + key + " = " + std::to_string(value) + " is outside [0, 1]");
}

void check_duration(const char* key, Duration value) {
  if (value < Duration::zero()) throw InputError(std::string("link: ") + key + " is below 0");
}

void check_conditions(const LinkImpairment& i) {
  check_probability("loss", i.loss);
  check_probability("duplication", i.duplication);
  check_probability("reordering", i.reordering);
  check_probability("burst_loss.loss_in_good", i.burst_loss.loss_in_good);
  check_probability("burst_loss.loss_in_bad", i.burst_loss.loss_in_bad);
  check_duration("delay", i.delay);
  check_duration("jitter", i.jitter);
  check_duration("slow_jitter", i.slow_jitter);
  check_duration("reorder_delay", i.reorder_delay);
  check_duration("burst_loss.mean_good", i.burst_loss.mean_good);
  check_duration("second_path", i.second_path);
  require(i.burst_loss.mean_bad > Duration::zero(), "burst_loss.mean_bad must be above 0");
  require(i.jitter_time > Duration::zero(), "jitter_time must be above 0");
  require(i.bursts_per_s >= 0, "bursts_per_s is below 0");
  require(i.burst_length > Duration::zero(), "burst_length must be above 0");
  require(i.rate_Bps >= 0, "rate_Bps is below 0");
  require(!i.in_order || i.reordering == 0, "reordering and in_order contradict each other");
}

}  // namespace

bool LinkImpairment::is_out(Time now) const noexcept {
  return std::any_of(outages.begin(), outages.end(), [now](const Outage& outage) {
    if (now < outage.from) return false;
    const Duration since = now - outage.from;
    return (outage.every > Duration::zero() ? since % outage.every : since) < outage.length;
  });
}

std::size_t LinkImpairment::changes_by(Time now) const noexcept {
  const auto later = std::find_if(changes.begin(), changes.end(), [now](const Change& c) { return c.at > now; });
  return static_cast<std::size_t>(later - changes.begin());
}

void check(const LinkImpairment& impairment) {
  check_conditions(impairment);
  for (const auto& outage : impairment.outages) {
    require(outage.length > Duration::zero(), "outages.length must be above 0");
    check_duration("outages.every", outage.every);
    require(outage.every == Duration::zero() || outage.every > outage.length, "outages.every must be above its length");
  }
  for (std::size_t n = 0; n < impairment.changes.size(); ++n) {
    const LinkImpairment::Change& change = impairment.changes[n];
    check_conditions(change.to);
    require(change.to.outages.empty() && change.to.changes.empty() && change.to.address_changes.empty(),
            "a change has outages, changes or address changes of its own");
    require(n == 0 || impairment.changes[n - 1].at <= change.at, "changes are not in order of time");
  }
  require(std::is_sorted(impairment.address_changes.begin(), impairment.address_changes.end()),
          "address_changes are not in order of time");
}

}  // namespace knuckle
