#include "app/programs/path_json.h"

#include "app/cli/json.h"
#include "app/programs/program_options.h"

namespace knuckle::programs {

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
