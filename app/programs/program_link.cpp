#include "app/programs/program_link.h"

#include <poll.h>
#include <unistd.h>

#include <array>

#include "app/programs/program_options.h"

namespace knuckle::programs {
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
